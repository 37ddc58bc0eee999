"""Endurance in virtual time: one daemon runs for hours. Memory must not grow, and every lost frame must be accounted
for.

    python -m benchmarks.daemon.soak [--hours 12] [--seed 1] [--talk-every 60]

The daemon runs with its own memory file and its wheels' worker thread, on fake motors in memory; instead of the
sound card stands a room with noise and one other speaker, who says any sentence of the phrasebook at random times,
sometimes cut short, calls a halt and lifts it, introduces strangers whose names are to be learned, and slams doors.
Now and then the card loses sound. The table has a line each virtual half hour; RSS has the fakes in it.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import os
import random
import sys
import tempfile
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import structlog

from hil_fakes.room import Air, PinkNoise
from hil_fakes.virtual_robot import VirtualRobot
from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.settings import AudioSettings
from hvcpd.config.settings_file import load_settings
from hvcpd.daemon.allocator import tune_allocator
from hvcpd.daemon.devices import Devices
from hvcpd.daemon.main_loop import Daemon
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.language import messages as m
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, Wheels

BLOCK = 400
"""Samples, 25 ms."""
TABLE_EVERY_S = 1800.0
STRANGER_EVERY_S = 7200.0
FIRST_STRANGERS, FIRST_STRANGERS_EVERY_S = 3, 1500.0
"""They have the voices of all that come later: within two hours the robot knows as many voices as it ever will."""
NAME_MB = 1.6
"""What a name more that is known may need (0.7 to 1.6 measured): its word in every voice, wherever a name may stand. A
robot knows 12 at most."""
REST_S = 10.0
"""The table has the robot when nobody has said anything for so long: while somebody speaks, hearing needs up to
13 MB more, which it then gives back."""
LOSS_EVERY_S = 600.0
LOST_BLOCKS = 4
"""A tenth of a second that the card loses at a time."""
DOOR_SHARE = 0.1
CUT_SHARE = 0.1
STOP_SHARE = 0.03
MAX_GROWTH_MB = 3.0
"""Of RSS from the second hour to the end; the allocator's arenas alone move by a megabyte or two."""
STRANGERS = ("zoe", "max", "kim", "ada", "una", "hal", "leo", "pip", "eve", "ivy")


class OverError(Exception):
    """The hours are over."""


@dataclass
class Talker:
    """The other one in the room: what its loudspeaker plays, block by block."""

    wiring: Wiring
    talk_every_s: float
    rng: random.Random
    waiting: deque[Samples] = field(default_factory=deque)
    said: int = 0
    _next_s: float = 60.0
    _next_stranger_s: float = FIRST_STRANGERS_EVERY_S
    _strangers: int = 0
    _resume_due: bool = False

    def __post_init__(self) -> None:
        self._book = make_phrasebook(self.wiring.names, self.wiring.settings.teams, self.wiring.tasks)
        self._speaker = self.wiring.sound.speaker_of("Bot")

    def block(self, now_s: float) -> Samples:
        """What is played at that time; shape (BLOCK,), float32."""
        if not self.waiting and now_s >= self._next_s:
            self._next_s = now_s + self.rng.expovariate(1.0 / self.talk_every_s)
            self._queue(self._sound(now_s))
        return self.waiting.popleft() if self.waiting else np.zeros(BLOCK, np.float32)

    def _queue(self, sound: Samples) -> None:
        self.said += 1
        padded = np.concatenate([sound, np.zeros(-len(sound) % BLOCK, np.float32)])
        self.waiting.extend(np.split(padded, len(padded) // BLOCK))

    def _sound(self, now_s: float) -> Samples:
        if self.rng.random() < DOOR_SHARE:
            noise = np.random.default_rng(self.said).standard_normal(SAMPLE_RATE_HZ // 2)
            return (0.5 * noise * np.exp(-np.arange(len(noise)) / (0.1 * SAMPLE_RATE_HZ))).astype(np.float32)
        sound = self._speaker.render(self._book.phrases(self._utterance(now_s)))
        return sound[: len(sound) // 2] if self.rng.random() < CUT_SHARE else sound

    def _utterance(self, now_s: float) -> m.Utterance:
        if self._resume_due:
            self._resume_due = False
            return m.Utterance(None, statement=m.Resume())
        if now_s >= self._next_stranger_s:
            name = STRANGERS[self._strangers % len(STRANGERS)]
            self._strangers += 1
            first = self._strangers < FIRST_STRANGERS
            self._next_stranger_s += FIRST_STRANGERS_EVERY_S if first else STRANGER_EVERY_S
            return m.Utterance(name.capitalize(), m.ToAll(), statement=m.Spelled(name))
        if self.rng.random() < STOP_SHARE:
            self._resume_due = True
            return m.Utterance(None, statement=m.Stop())
        while True:
            utterance = self._book.sample(self.rng)
            if utterance.speaker in (None, "Bot") and not isinstance(utterance.statement, m.NameTaken | m.Stop):
                return utterance


@dataclass
class SoakStream:
    """A sound card in virtual time, with one robot and a talker in its room."""

    robot: VirtualRobot
    talker: Talker
    limit_s: float
    seed: int
    daemon: Daemon | None = None
    counters: StreamCounters = field(default_factory=StreamCounters)
    latency_s: float = 0.0
    now_s: float = 0.0
    table: list[Line] = field(default_factory=list)
    _playing: Samples = field(default_factory=lambda: np.zeros(BLOCK, np.float32))
    _lost: int = 0
    _next_loss_s: float = LOSS_EVERY_S
    _next_note_s: float = TABLE_EVERY_S
    _sound_s: float = 0.0
    """When something was said last."""

    def __post_init__(self) -> None:
        air = Air()
        self._gain = air.source_gain
        self._own_gain = air.source_gain / air.own_distance_m
        self._rng = np.random.default_rng(self.seed)
        self._noise = PinkNoise(air.noise_rms, self.seed).take(60 * SAMPLE_RATE_HZ)
        self._began_s = time.perf_counter()

    async def open(self, afresh: bool = False) -> None:
        """Nothing to open."""

    async def start(self) -> None:
        """Nothing to start."""

    async def read(self) -> Samples:
        """Let everything settle, then let a block of time pass; raises OverError at the end of the hours."""
        if self.daemon is not None:
            await self.daemon.settled()
        heard = self._pass()
        if self.now_s >= self._next_loss_s:
            self._next_loss_s += LOSS_EVERY_S
            for _ in range(LOST_BLOCKS):
                self._lost += len(self._pass())
            self.counters = StreamCounters(input_dropped=self._lost)
        elif self.now_s - self._sound_s >= REST_S and self.now_s >= min(self._next_note_s, self.limit_s):
            self._next_note_s += TABLE_EVERY_S
            self._note()
            if self.now_s >= self.limit_s:
                raise OverError("the hours are over")
        return heard

    def write(self, samples: Samples) -> None:
        """Played over the next block."""
        self._playing = samples

    async def close(self) -> None:
        """Nothing to close."""

    def _pass(self) -> Samples:
        """A block of what the microphone takes: the talker at 1 m, itself, noise of the room."""
        at = int(self._rng.integers(len(self._noise) - BLOCK))
        said = self.talker.block(self.now_s)
        if said.any() or self._playing.any():
            self._sound_s = self.now_s
        heard = self._noise[at : at + BLOCK] + self._gain * said
        heard += self._own_gain * self._playing
        self._playing = np.zeros(BLOCK, np.float32)
        self.robot.time.advance(BLOCK / SAMPLE_RATE_HZ)
        self.now_s += BLOCK / SAMPLE_RATE_HZ
        return np.clip(heard, -1.0, 1.0).astype(np.float32)

    def _note(self) -> None:
        gc.collect()
        robot = self.daemon.robot if self.daemon is not None else None
        found = gc.get_objects()
        line = Line(
            self.now_s / 3600.0,
            rss_mb(),
            sum(1 for _ in Path("/proc/self/fd").iterdir()),
            threading.active_count(),
            len(asyncio.all_tasks()),
            len(found),
            max(len(each) for each in found if isinstance(each, list | deque)),
            self.talker.said,
            round((self.now_s - (robot.now if robot is not None else 0.0)) * SAMPLE_RATE_HZ) // BLOCK - 1,
            time.perf_counter() - self._began_s,
            len(robot.phrasebook.vocabulary.names) if robot is not None else 0,
        )
        self.table.append(line)
        print(line.text, flush=True)


@dataclass(frozen=True)
class Line:
    """The daemon's process at one time. `missed` is in blocks, those counted as lost left out."""

    hours: float
    rss_mb: float
    descriptors: int
    threads: int
    tasks: int
    objects: int
    longest: int
    said: int
    missed: int
    wall_s: float
    names: int

    @property
    def text(self) -> str:
        return (
            f"{self.hours:6.2f} {self.rss_mb:8.1f} {self.descriptors:5d} {self.threads:8d} {self.tasks:6d} "
            f"{self.objects:9d} {self.longest:8d} {self.said:6d} {self.missed:7d} {self.wall_s:7.0f} {self.names:6d}"
        )


HEAD = " hours   RSS MB   fds  threads  tasks   objects  longest   said  missed  wall s  names"


def rss_mb() -> float:
    """This process's resident memory."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def soak(hours: float, seed: int, talk_every_s: float) -> list[Line]:
    """Live for so many virtual hours; a line of the table each half hour."""
    with tempfile.TemporaryDirectory() as directory:
        given: dict[str, object] = {"name": "Rob", "state_dir": directory, "seed": seed}
        settings = load_settings(None, given, system_path=Path(directory) / "none.yaml")
        wiring = wire_up(settings)
        robot = VirtualRobot("dynamixel", seed)
        talker = Talker(wiring, talk_every_s, random.Random(seed))
        stream = SoakStream(robot, talker, hours * 3600.0, seed)

        def make_stream(_: AudioSettings) -> SoakStream:
            return stream

        def make_wheels(*_: object) -> Wheels:
            return robot.wheels

        daemon = stream.daemon = Daemon(wiring, Devices(lambda: None, make_stream, make_wheels))
        try:
            asyncio.run(daemon.run())
        except OverError:
            return stream.table
        raise AssertionError("the daemon ended before the hours were over")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=12.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--talk-every", type=float, default=60.0, help="seconds from one sentence to the next, mean")
    options = parser.parse_args()
    tune_allocator()
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(30))
    print(HEAD, flush=True)
    table = soak(options.hours, options.seed, options.talk_every)
    early = next((line for line in table if line.hours >= 2.0), table[0])
    last = table[-1]
    grown = last.rss_mb - early.rss_mb
    learned = last.names - early.names
    limit = MAX_GROWTH_MB + NAME_MB * learned
    when = f"from hour {early.hours:.1f} to hour {last.hours:.1f}"
    print(f"RSS grew by {grown:+.1f} MB {when}, with {learned} names more (limit {limit:.1f})")
    same = (early.descriptors, early.threads, early.tasks) == (last.descriptors, last.threads, last.tasks)
    print(f"descriptors, threads and tasks {'are as they were' if same else 'HAVE CHANGED'}")
    sys.exit(0 if grown <= limit and same and last.missed == early.missed else 1)


if __name__ == "__main__":
    main()
