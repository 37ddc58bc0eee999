"""`hvcpctl listen`: what a microphone takes is followed, and read with the team's key."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS, AudioSettings
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.control.cli import make_parser
from hvcpd.control.hear import listen
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_capture import Block, capture
from hvcpd.hardware.soundfile import write_wav
from hvcpd.language import messages as m
from hvcpd.language.spelling import CODE_WORDS, number_of
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.robot.sealing import Sealing
from hvcpd.robot.speech_output import spoken
from hvcpd.security.guard import Guard
from hvcpd.security.keyring import Entry, KeyFile, write_key_file
from hvcpd.security.keys import KEY_BYTES, TeamKey
from tests.control.conftest import Ran
from tests.hardware.fake_card import HEADSET, FakeCard

DAY = date(2026, 11, 21)


def test_a_microphone_gives_its_blocks_in_order_until_it_is_gone() -> None:
    card = FakeCard([HEADSET])
    heard = np.linspace(-0.5, 0.5, 1600, dtype=np.float32)
    taken: list[Samples] = []

    def listen_to_the_end() -> None:
        with capture(AudioSettings(), card) as blocks:
            microphone = card.inputs[-1]
            frames = np.repeat(heard.reshape(-1, 1), microphone.options["channels"], axis=1)
            microphone.coming.append((frames, _NoFault()))
            microphone.gone = True
            taken.extend(sound for sound, lost in blocks if lost is None)

    with pytest.raises(DeviceError, match="is gone"):
        listen_to_the_end()
    np.testing.assert_allclose(np.concatenate(taken), heard, atol=1e-6)
    assert card.inputs[-1].closed


class _NoFault:
    input_overflow = False


def test_without_a_microphone_it_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    def no_card(settings: AudioSettings) -> object:
        return capture(settings, FakeCard([]))

    with pytest.raises(DeviceError, match="microphone"):
        listen.run(make_parser().parse_args(["listen"]), no_card)  # type: ignore[arg-type]


@pytest.mark.slow
def test_people_with_the_key_read_what_others_hear_as_sealed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], ran: Ran
) -> None:
    keys = KeyFile((Entry(TeamKey(random.Random(40).randbytes(KEY_BYTES)), DAY, DAY),))
    write_key_file(tmp_path / "team.key", keys, replaces=False)
    book = make_phrasebook(("Rob", "Bot"), DEFAULT_TEAMS, load_tasks(default_tasks_path()), True, True)
    order = m.Utterance("Bot", m.ToRobot("Rob"), None, m.TurnBy(90.0))
    right = Sealing(Guard("Bot", keys.ring(DAY)), encrypts=True).marked(order, book, 0.0)
    assert isinstance(right.mark, m.Cipher)
    wrong = replace(order, mark=replace(right.mark, value=right.mark.value ^ 1))
    speaker = make_sound(None, user_cache_folder()).speaker_of("Bot")
    gap = np.zeros(2 * SAMPLE_RATE_HZ, np.float32)
    sound = np.concatenate([gap] + [part for u in (right, wrong) for part in (spoken(speaker, u, book), gap)])
    write_wav(tmp_path / "said.wav", sound)

    @contextmanager
    def microphone(settings: AudioSettings) -> Iterator[Iterator[Block]]:
        yield ((sound[at : at + 400], None) for at in range(0, len(sound), 400))

    plain = "Hi Rob, I am Bot, turn left"
    with_key = ["--json", "--key", str(tmp_path / "team.key")]
    listen.run(make_parser().parse_args(["listen", *with_key]), microphone)
    read = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [(each["text"], each["seal"]) for each in read] == [
        (plain, "right"),
        ("Hi Rob, I am Bot, sealed message", "wrong"),
    ]
    others = [json.loads(line) for line in ran("hear", tmp_path / "said.wav", "--json").splitlines()]
    assert [each["text"] for each in others] == ["Hi Rob, I am Bot, sealed message"] * 2


@pytest.mark.parametrize("encrypted", [False, True])
def test_the_card_of_a_team_with_a_key_shows_what_a_seal_sounds_like(encrypted: bool, tmp_path: Path, ran: Ran) -> None:
    settings = tmp_path / "hvcpd.yaml"
    settings.write_text(f"security: {{key: team.key, encrypted: {str(encrypted).lower()}}}\n")
    card = json.loads(ran("phrases", "--json", "--config", settings))
    said = [line["say"] for line in card["statements"]]
    seals = [number_of(text.removeprefix("…, ").split()) for text in said if text.startswith("…, ")]
    assert len(seals) == 2
    assert any(seals)
    assert "…, code one two three four five six" in said
    assert any(text.startswith("sealed message, ") for text in said) == encrypted
    assert dict(card["words"])["CODE WORD"] == list(CODE_WORDS)
    plain = ran("phrases")
    assert "CODE WORD" not in plain
    assert "sealed" not in plain
