"""Voices that no robot has: understood if they are enrolled, or by PocketSphinx."""

from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly import DEFAULT_TEAMS, Sound, make_phrasebook, make_recogniser, make_sound
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.coordination.people import SURE
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.people.ears import AtOnce, Piece, SecondEars
from hvcpd.people.enrolled import Person
from hvcpd.people.enrolled_listener import chance
from hvcpd.people.matching import Match, MatchedWord
from hvcpd.people.opinion import STRANGER, SecondOpinion, guess_chance, snr_of
from hvcpd.people.sphinx import Guess, accented
from hvcpd.people.takes import check_take
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.frontend import Energies
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, Voice, voice_for

SENTENCES = ("hi rob, i am anna, what is left", "bot, turn left", "hi all, i am anna, complete task two", "rob stop")

CHILD = Voice("child", 240.0, 1.35, 0.92, -32.0, 0.6, 3000.0)
"""Unlike all robots' voices."""


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


@pytest.fixture(scope="module")
def book() -> Phrasebook:
    return make_phrasebook(("Rob", "Bot", "Anna"), DEFAULT_TEAMS, load_tasks(default_tasks_path()))


def stranger(sound: Sound) -> Speaker:
    """A voice that neither Rob nor Bot has."""
    robots = {voice_for(name).name for name in ("Rob", "Bot")}
    return Speaker(next(v for v in VOICES if v.name not in robots), sound.lexicon, sound.cache)


def in_room(sounds: Sequence[Samples], gain: float, noise_rms: float = 3e-4) -> Samples:
    gap = np.zeros(round(1.6 * SAMPLE_RATE_HZ), np.float32)
    clean = np.concatenate([gap, gap, *[part for s in sounds for part in (gain * s, gap)], gap])
    return np.asarray(clean + noise_rms * np.random.default_rng(4).standard_normal(len(clean)), np.float32)


def phrases(text: str) -> list[list[str]]:
    return [part.split() for part in text.split(", ")]


def heard(book: Phrasebook, sound: Sound, people: Sequence[Person], strangers: bool, room: Samples) -> list[Event]:
    known = {person.name: person for person in people}
    opinion = SecondOpinion(book.people_graph, sound.lexicon, known, strangers)
    ears = SecondEars(make_recogniser(book, ("Rob", "Bot"), sound), opinion, AtOnce())
    return [e for at in range(0, len(room), 1600) for e in ears.push(room[at : at + 1600])]


@pytest.mark.slow
def test_an_enrolled_voice_is_understood_from_single_words(book: Phrasebook, sound: Sound) -> None:
    speaker = Speaker(CHILD, sound.lexicon, sound.cache)
    takes = {}
    for word in book.people_graph.words:
        check = check_take(np.pad(speaker.render([[word]]), 4000))
        if check.energies is not None:
            takes[word] = [check.energies]
    assert len(takes) > 0.9 * len(book.people_graph.words)
    room = in_room([speaker.render(phrases(text)) for text in SENTENCES], 0.5)
    events = heard(book, sound, [Person("Anna", takes)], False, room)
    wanted = [tuple(text.replace(",", "").split()) for text in SENTENCES]
    assert [e.words for e in events if isinstance(e, Recognised)] == wanted
    assert {e.voice for e in events if isinstance(e, Recognised)} == {"anna, enrolled"}
    # Where each sentence was is told in the robot's own time.
    first = next(e for e in events if isinstance(e, Recognised))
    assert abs(first.start_sample / SAMPLE_RATE_HZ - 3.2) < 0.3


@pytest.mark.slow
def test_pocketsphinx_hears_who_is_not_enrolled(book: Phrasebook, sound: Sound) -> None:
    pytest.importorskip("pocketsphinx")
    texts = ("who is here", "hi all", "what is left", "move forward")
    room = in_room([stranger(sound).render(phrases(text)) for text in texts], 0.5)
    events = heard(book, sound, [], True, room)
    understood = [e for e in events if isinstance(e, Recognised)]
    assert [" ".join(e.words) for e in understood] == list(texts)
    assert {e.voice for e in understood} == {STRANGER}
    assert all(book.parse(e.words) for e in understood)


@pytest.mark.slow
def test_words_of_nobody_stay_garbled(book: Phrasebook, sound: Sound) -> None:
    pytest.importorskip("pocketsphinx")
    chooser = random.Random(5)
    lexicon = sorted(w for w in sound.lexicon.entries if w.isalpha() and w not in book.graph.words)
    talk = [stranger(sound).render([[chooser.choice(lexicon) for _ in range(5)]]) for _ in range(5)]
    events = heard(book, sound, [], True, in_room(talk, 0.5))
    assert sum(isinstance(e, Garbled) for e in events) >= 3
    # What is made up all the same must not move wheels by itself.
    assert all(e.confidence < SURE for e in events if isinstance(e, Recognised))


def test_what_fits_worse_is_less_sure() -> None:
    def guess(misfit: float, worst: float, speech_s: float = 0.7) -> float:
        return guess_chance(Guess(("turn", "left"), ((0, 20), (20, 45)), misfit, worst, 1.0), speech_s)

    assert guess(2.5, 3.5) > 0.95 > guess(4.0, 6.0) > guess(5.0, 8.0)
    assert guess(3.5, 5.0, 3.0) < 0.5 < guess(3.5, 5.0)  # two words do not take three seconds
    assert guess(6.5, 9.0) < 0.1

    def match(deficit: float, passed_over: float = 0.1, above_noise: float = 2.0, margin: float = 20.0) -> float:
        words = tuple(MatchedWord(w, k * 20, k * 20 + 20, deficit, margin) for k, w in enumerate(("turn", "left")))
        return chance(Match("anna, enrolled", words, passed_over, above_noise))

    assert match(0.2) > 0.95 > match(0.9) > match(2.0)
    assert match(2.0) < 0.1
    assert match(0.5, passed_over=0.7) < 0.5 < match(0.5)  # half of the speech was taken for noise
    assert match(0.0, above_noise=0.0, margin=1.0) < 0.8 < match(0.0)  # there was nothing to be heard
    assert match(0.5, margin=0.3) < 0.8 < match(0.5)  # another word fits as well


class Fixed:
    """Stands for PocketSphinx: the same misfits for whatever is heard."""

    def __init__(self, words: str, misfit: float, call_misfit: float, call_noise: float) -> None:
        said = tuple(words.split())
        self._guess = Guess(said, tuple((60 + 30 * k, 90 + 30 * k) for k in range(len(said))), misfit, misfit, 0.5)
        self._call = Guess(("stop",), ((60, 100),), call_misfit, call_misfit, call_noise)

    def guess(self, _piece: Piece) -> Guess | None:
        return self._guess

    def call(self, _piece: Piece) -> Guess | None:
        return self._call


def look(book: Phrasebook, sound: Sound, fixed: Fixed, speech_s: float) -> Recognised | None:
    opinion = SecondOpinion(book.people_graph, sound.lexicon, {}, True, fixed)
    n = round(speech_s * SAMPLE_RATE_HZ)
    heard_sound = np.concatenate([np.zeros(SAMPLE_RATE_HZ), 0.1 * np.sin(np.arange(n))]).astype(np.float32)
    return opinion.look(Piece(heard_sound, SAMPLE_RATE_HZ, 50_000, 50_000 + n, 50_000 - SAMPLE_RATE_HZ))


@pytest.mark.parametrize(
    ("fixed", "understood"),
    [
        (Fixed("turn left", 3.5, 3.0, 0.5), ("stop",)),
        (Fixed("turn left", 3.0, 3.0, 0.5), ("turn", "left")),
        (Fixed("turn left", 3.5, 3.0, 4.0), ("turn", "left")),
        (Fixed("turn left", 3.5, 4.0, 0.5), ("turn", "left")),
        (Fixed("turn left", 3.5, 3.4, 0.5), ("turn", "left")),
        (Fixed("stop", 3.0, 3.0, 4.0), None),
        (Fixed("hi rob i am anna stop", 3.0, 3.0, 4.0), ("hi", "rob", "i", "am", "anna", "stop")),
        (Fixed("turn left", 7.0, 6.0, 2.0), None),
    ],
)
def test_stop_is_heard_where_it_fits_as_a_call(
    book: Phrasebook, sound: Sound, fixed: Fixed, understood: tuple[str, ...] | None
) -> None:
    found = look(book, sound, fixed, 1.0)
    assert (found.words if found is not None else None) == understood
    assert found is None or found.confidence < SURE


def test_where_there_is_no_time_for_more_a_call_may_fit_worse(book: Phrasebook, sound: Sound) -> None:
    doubtful = Fixed("turn left", 7.0, 3.7, 2.5)  # as one of a synthetic voice that nobody had heard before
    short, long = look(book, sound, doubtful, 0.7), look(book, sound, doubtful, 1.5)
    assert short is not None
    assert short.words == ("stop",)
    assert long is None


def takes_of(speaker: Speaker, *words: str) -> dict[str, list[Energies]]:
    checks = {word: check_take(np.pad(speaker.render([[word]]), 4000)).energies for word in words}
    return {word: [energies] for word, energies in checks.items() if energies is not None}


def alone(speaker: Speaker, text: str) -> Piece:
    """One sentence, and 3.2 s of noise before it."""
    speech, lead = speaker.render([text.split()]), round(3.2 * SAMPLE_RATE_HZ)
    return Piece(in_room([speech], 0.5), lead, 0, len(speech), -lead)


@pytest.mark.parametrize(
    ("guessing", "else_heard"),
    [(Fixed("move forward", 3.0, 9.0, 9.0), ("move", "forward")), (Fixed("move forward", 3.5, 3.0, 0.5), ("stop",))],
)
def test_an_enrolled_voice_that_is_sure_counts_before_what_a_stranger_seems_to_say(
    book: Phrasebook, sound: Sound, guessing: Fixed, else_heard: tuple[str, ...]
) -> None:
    speaker = Speaker(CHILD, sound.lexicon, sound.cache)
    known = {"anna": Person("Anna", takes_of(speaker, "turn", "left", "right"))}
    opinion = SecondOpinion(book.people_graph, sound.lexicon, known, True, guessing)
    found = [opinion.look(alone(speaker, text)) for text in ("turn left", "water the rose")]
    assert [(e.words, e.voice) for e in found if e is not None] == [
        (("turn", "left"), "anna, enrolled"),
        (else_heard, STRANGER),
    ]


def test_the_sentence_that_is_nearer_is_likelier(book: Phrasebook, sound: Sound) -> None:
    speaker = Speaker(CHILD, sound.lexicon, sound.cache)
    known = {"anna": Person("Anna", takes_of(speaker, "turn", "left", "right"))}
    piece = alone(stranger(sound), "turn right")
    found = {}
    for misfit in (1.5, 12.0):
        guessing = Fixed("move forward", misfit, 9.0, 9.0)
        opinion = SecondOpinion(book.people_graph, sound.lexicon, known, True, guessing)
        found[misfit] = opinion.likeliest(piece), opinion.look(piece)
    assert [e.words for e in found[1.5] if e is not None] == [("move", "forward")] * 2
    likeliest, _ = found[12.0]
    assert likeliest is not None
    assert likeliest.voice == "anna, enrolled"


def test_words_count_as_soon_as_they_are_learned(book: Phrasebook, sound: Sound) -> None:
    speaker = Speaker(CHILD, sound.lexicon, sound.cache)
    known = {"anna": Person("Anna", takes_of(speaker, "turn", "right"))}
    opinion = SecondOpinion(book.people_graph, sound.lexicon, known, False)
    before = opinion.look(alone(speaker, "turn left"))
    assert before is None or before.words != ("turn", "left")
    known["anna"] = known["anna"].with_takes(takes_of(speaker, "left"))
    after = opinion.look(alone(speaker, "turn left"))
    assert after is not None
    assert after.words == ("turn", "left")


def test_the_noise_is_that_of_the_quiet_before_the_speech() -> None:
    noise = 0.01 * np.random.default_rng(1).standard_normal(3 * SAMPLE_RATE_HZ)
    speech = 0.1 * np.sin(np.arange(SAMPLE_RATE_HZ))
    lead = noise.copy()
    lead[:16000] += 0.3 * np.sin(np.arange(16000))  # somebody has spoken before
    piece = Piece(np.concatenate([lead, speech]).astype(np.float32), len(lead), 0, SAMPLE_RATE_HZ, 0)
    assert snr_of(piece) == pytest.approx(17.0, abs=2.0)
    assert snr_of(Piece(speech.astype(np.float32), 0, 0, SAMPLE_RATE_HZ, 0)) > 1e6


def test_other_accents_have_other_vowels_and_drop_their_r() -> None:
    assert ("S", "T", "AO", "P") in set(accented(("S", "T", "AA", "P")))
    assert ("F", "AO", "W", "AH", "D") in set(accented(("F", "AO", "R", "W", "ER", "D")))
    assert all("R" in said for said in accented(("R", "OW", "Z")))
