"""The fuzz targets: each parser of external input, with valid inputs as seeds."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.settings_file import load_settings
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.daemon.control_protocol import RefusalError, checked_arguments, id_of, parse_request, reply_line
from hvcpd.daemon.pose_keeper import PoseKeeper
from hvcpd.hardware.soundfile import read_wav, write_wav
from hvcpd.memory.store import PeerRecord, Store, TaskRecord, TranscriptReader, TranscriptRecord
from hvcpd.security.keyring import parse_key_file, written
from hvcpd.synthesis.lexicon import _read as read_lexicon

NAMES, TEAMS = ("Rob", "Bot", "Zoe"), ("plant", "a", "b")
KEY = b"key 000102030405060708090a0b0c0d0e0f made 2026-11-21 from 2026-11-21 until 2026-12-21\nrevoked Zoe\n"
POSE = b'{"x_m": 1, "y_m": 2, "heading_rad": 0, "left_rad": 0, "right_rad": 0, "boot": "b"}'
SETTINGS = b"""name: Rob
teams: [plant, a]
speech: {rate: slow, repeat: 2}
peers: {Bot: {voice: oak}}
start: {x_m: -1.5, y_m: 2, heading_deg: 90}
audio: {input_device: null, block_ms: 25}
security: {key: team.key, people: nothing}
seed: 1
"""


@dataclass(frozen=True)
class Target:
    """`run` takes the bytes, as a file where there is one; `seeds` are good inputs to begin with."""

    run: Callable[[bytes, Path], None]
    seeds: tuple[bytes, ...]


def request(data: bytes, _: Path) -> None:
    id_of(data)
    try:
        asked = parse_request(data)
        reply_line(asked.id, checked_arguments(asked, {"kinds": (list,), "text": (str,), "n": (int, float)}))
    except RefusalError:
        pass


def settings(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    load_settings(file, environment={})


def tasks(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    make_phrasebook(NAMES, TEAMS, load_tasks(file))


def lexicon(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    found = read_lexicon(file)
    for word in found.entries:
        found.spoken(word)


def wav(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    assert np.isfinite(read_wav(file)).all()


def key(data: bytes, _: Path) -> None:
    found = parse_key_file(data.decode("utf-8", "replace"), "key")
    assert parse_key_file(written(found), "key") == found
    found.ring(None)


def pose(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    PoseKeeper(file, file.with_name("boot")).recall()


def sentence(data: bytes, _: Path) -> None:
    utterance = BOOK.parse_text(data.decode("utf-8", "replace"))
    assert BOOK.parse(BOOK.render(utterance)) == utterance


def memory(data: bytes, file: Path) -> None:
    for old in file.parent.glob(file.name + "*"):
        old.unlink()
    file.write_bytes(data)
    store = Store(file)
    try:
        store.tasks(), store.transcript(), store.peers(), store.counters(), store.flags()
        store.save_peer(PeerRecord("Zoe", None, 3.0))
    finally:
        store.close()
    reader = TranscriptReader(file)
    try:
        reader.rows()
    finally:
        reader.close()


def _memory_seed() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "memory.sqlite3"
        store = Store(file)
        store.save_task(TaskRecord(1, "water the red rose", "claimed", "Rob", 2.0))
        store.append_transcript(TranscriptRecord(1.0, "said", "Rob", "Hi all, I am Rob", 0.9))
        store.save_peer(PeerRecord("Bot", "plant", 1.0))
        store.raise_counter("a/rob", 3)
        store.close()
        return file.read_bytes()


def _wav_seed() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sound.wav"
        write_wav(file, np.linspace(-0.5, 0.5, 160, dtype=np.float32))
        return file.read_bytes()


BOOK = make_phrasebook(NAMES, TEAMS, load_tasks(default_tasks_path()), sealed=True)
TARGETS = {
    "request": Target(request, (b'{"id": 1, "command": "status", "kinds": ["heard"], "n": 2.5}\n',)),
    "settings": Target(settings, (SETTINGS,)),
    "tasks": Target(tasks, (default_tasks_path().read_bytes(),)),
    "lexicon": Target(lexicon, (b"zorg Z AO1 R G\nwind(verb) W AY1 N D # so\nrob(2) R AA1 B\n",)),
    "wav": Target(wav, (_wav_seed(),)),
    "key": Target(key, (KEY,)),
    "pose": Target(pose, (POSE,)),
    "sentence": Target(sentence, (b"Hi Rob, I am Bot, complete task one, alpha bravo tango echo",)),
    "memory": Target(memory, (_memory_seed(),)),
}
