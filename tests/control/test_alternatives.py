"""A phrase that counts as a word: heard as it, never said, refused where it would be taken for another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.make import make_template_recogniser
from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.assembly.vocabulary import check, refusal
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.tasks import TaskDefinition, TaskRepository, Wait
from hvcpd.control.cli import main
from hvcpd.errors import PhraseError
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.synthesis.voices import voice_for

pytestmark = pytest.mark.slow

SOUND = make_sound(None, user_cache_folder())
NAMES = ("Rob", "Bot")


def book(*alternatives: tuple[str, str]) -> Phrasebook:
    names = ("water the indigo rose", "water the green rose")
    tasks = tuple(TaskDefinition(n, name, None, (Wait(1),)) for n, name in enumerate(names, start=1))
    return make_phrasebook(NAMES, DEFAULT_TEAMS, TaskRepository(tasks, alternatives=alternatives))


def said(*phrases: str) -> Samples:
    """In Rob's voice, with a second of a quiet room around it."""
    speaker = SOUND.speaker_in(voice_for("Rob"))
    speech = np.pad(speaker.render([phrase.split() for phrase in phrases]), SAMPLE_RATE_HZ)
    noise = np.random.default_rng(1).standard_normal(len(speech)) * 10.0 ** (-60.0 / 20.0)
    return np.asarray(speech + noise, np.float32)


def heard(phrasebook: Phrasebook, sound: Samples) -> list[str]:
    recogniser = make_template_recogniser(phrasebook, NAMES, SOUND)
    return [" ".join(e.words) for e in recogniser.push(sound) + recogniser.flush() if isinstance(e, Recognised)]


@pytest.mark.parametrize("phrase", ["strawberry", "basket"])
def test_what_counts_as_a_word_is_heard_as_it_and_only_then(phrase: str) -> None:
    sound = said("hi bot", "i am rob", f"water the {phrase} rose")
    sentence = "hi bot i am rob water the indigo rose"
    assert sentence not in heard(book(), sound)
    assert heard(book(("indigo", phrase)), sound) == [sentence]


def test_the_word_itself_and_all_others_are_heard_as_before() -> None:
    for colour in ("indigo", "green"):
        sound = said("hi bot", "i am rob", f"water the {colour} rose")
        assert heard(book(("indigo", "in the go")), sound) == [f"hi bot i am rob water the {colour} rose"]


def test_it_can_be_neither_written_nor_said() -> None:
    phrasebook = book(("indigo", "in the go"))
    with pytest.raises(PhraseError, match="'in' is not in the phrasebook after 'hi rob i am bot water the'"):
        phrasebook.parse_text("Hi Rob, I am Bot, water the in the go rose")
    assert phrasebook.graph == book().graph


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        (("indgo", "in the go"), "alternatives: 'indgo' is not a word of the phrasebook; did you mean 'indigo'?"),
        (("zzz", "in the go"), "alternatives: 'zzz' is not a word of the phrasebook; leave it out"),
        (("indigo", "green"), "alternatives: 'green' cannot count as 'indigo', because it can be said there itself"),
        (
            ("indigo", "indigo rose"),
            "alternatives: 'indigo rose' cannot count as 'indigo', because it can be said there itself",
        ),
    ],
)
def test_alternatives_that_make_no_sense_are_refused(pair: tuple[str, str], message: str) -> None:
    with pytest.raises(PhraseError) as error:
        book(pair)
    assert str(error.value).startswith(message)


@pytest.mark.parametrize("chosen_only", [True, False])
def test_an_alternative_that_sounds_like_another_word_is_refused(chosen_only: bool) -> None:
    found = check(book(("indigo", "greene")), ("Rob",), SOUND, chosen_only=chosen_only)
    text = refusal(found, Path("tasks.yaml"))
    assert text is not None
    assert "sound the same, by the words 'green' and 'greene'; " in text.splitlines()[0]
    assert "leave the alternative of 'indigo' out of the task file" in text
    others = check(book(("indigo", "in the go")), ("Rob",), SOUND, chosen_only=chosen_only)
    assert refusal(others, Path("tasks.yaml")) is None


def test_a_word_does_not_compete_with_what_counts_as_it() -> None:
    found = check(book(("indigo", "indy go"), ("indigo", "in the go")), ("Rob",), SOUND)
    assert not any({c.first, c.second} <= {"indigo", "indy go", "in the go"} for c in found)


def test_commands_tell_of_bad_alternatives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "tasks.yaml"
    path.write_text("tasks:\n  - {number: 1, name: water it, actions: [{wait: 1}]}\nalternatives: {watre: [what a]}\n")
    assert main(["phrases", "--tasks", str(path)]) == 2
    assert capsys.readouterr().err == (
        f"hvcpctl: {path}:3: alternatives: 'watre' is not a word of the phrasebook; did you mean 'water'?\n"
    )
