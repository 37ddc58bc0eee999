"""`hvcpctl hear --key`: people follow sealed speech, and are told which seals fit."""

from __future__ import annotations

import json
import random
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.hardware.soundfile import write_wav
from hvcpd.language import messages as m
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.robot.sealing import Sealing
from hvcpd.security.guard import Guard
from hvcpd.security.keyring import Entry, KeyFile, write_key_file
from hvcpd.security.keys import KEY_BYTES, TeamKey
from tests.control.conftest import Ran

pytestmark = pytest.mark.slow
DAY = date(2026, 11, 21)


def test_a_recording_is_followed_and_its_seals_are_checked(tmp_path: Path, ran: Ran) -> None:
    keys = KeyFile((Entry(TeamKey(random.Random(3).randbytes(KEY_BYTES)), DAY, DAY),))
    write_key_file(tmp_path / "team.key", keys, replaces=False)
    book = make_phrasebook(("Rob", "Bot"), DEFAULT_TEAMS, load_tasks(default_tasks_path()), sealed=True)
    sealing = Sealing(Guard("Bot", keys.ring(DAY)))
    order = m.Utterance("Bot", m.ToRobot("Rob"), None, m.TurnBy(90.0))
    right = sealing.marked(order, book, 0.0)
    wrong = replace(order, mark=m.Seal(1234567))
    speaker = make_sound(None, user_cache_folder()).speaker_of("Bot")
    gap = np.zeros(2 * SAMPLE_RATE_HZ, np.float32)
    pieces = [gap] + [part for u in (right, right, wrong) for part in (speaker.render(book.phrases(u)), gap)]
    write_wav(tmp_path / "said.wav", np.concatenate(pieces))
    lines = ran("hear", tmp_path / "said.wav", "--json", "--key", tmp_path / "team.key").splitlines()
    heard = [json.loads(line) for line in lines]
    assert [sentence["seal"] for sentence in heard] == ["right", "used", "wrong"]
    assert heard[0]["text"] == book.write(right)
