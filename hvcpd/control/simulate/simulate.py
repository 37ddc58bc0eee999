"""`hvcpctl simulate`: a mission of whole robots in a simulated room."""

from __future__ import annotations

import argparse
import math
import random
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hil_fakes.bench import Bench, BenchPlan
from hil_fakes.furnished_room import FurnishedRoom
from hil_fakes.loudspeakers import IDEAL, USUAL
from hil_fakes.room import Air, FreeField
from hil_fakes.skills import FakeDevice, FakePump, usual_devices
from hvcpd.assembly.plan import speech_of
from hvcpd.config.files import make_writable
from hvcpd.config.settings import Settings, SpeechSettings
from hvcpd.config.task_doubts import doubts
from hvcpd.config.tasks import Tend, Use
from hvcpd.control.keys.key import today
from hvcpd.control.output import print_note
from hvcpd.control.simulate.day import run_hours
from hvcpd.control.simulate.team import (
    Team,
    as_written,
    lacked_skills,
    load_team,
    refuse_confusable,
    robots_of,
    taking_part,
    unable_robots,
)
from hvcpd.coordination.actions import Speech, Talk
from hvcpd.errors import EX_FAILURE, EX_OK, AudioFileError, ConfigError, DeviceError, writing
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import Samples
from hvcpd.reporting.events import Event, MissionRecord, Started, Summary
from hvcpd.security.keyring import keep_out_of_dumps, read_key_file
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.skills.checks import faults

MAX_ROBOTS = 12
"""Most robots; more fit neither into the start corner nor into the air, because each task takes about 13 s of talk."""

ANOTHER_FOLDER = "name another directory"

Sink = Callable[[Event], None]
Pace = Callable[[float, Samples], None]


def run(options: argparse.Namespace) -> int:
    """Run the mission, show it, write the report; returns 0 only if every task was done exactly once."""
    robots: tuple[str, ...] = options.robots or robots_of(options)
    options.robots = robots
    if len(robots) > MAX_ROBOTS:
        raise ConfigError(f"--robots: {len(robots)} is too many; at most {MAX_ROBOTS}")
    keys = _keys(options)
    if options.encrypted and keys is None:
        raise ConfigError("--encrypted: there is no key to encrypt with; add --key, or --key FILE")
    if options.loss and options.hours is None:
        raise ConfigError("--loss is for missions by words; add --hours, or make the room louder with --noise-db")
    team = load_team(
        options, robots, allow_confusable=options.allow_confusable, sealed=keys is not None, encrypted=options.encrypted
    )
    options.pick, options.talk = options.pick or team.settings.pick, options.talk or team.settings.talk
    coordinator = _coordinator(options, robots, team.settings)
    for text in doubts(team.tasks, len(robots) - 1 if coordinator is not None else None):
        print_note(f"warning: {team.settings.tasks}: {text}")
    for name in robots:
        if keys is not None and keys.is_revoked(name):
            print_note(f"warning: {name} is revoked in {options.key}: nobody believes what it says")
    if options.hours is not None:
        if options.report is not None:
            _make_directory(options.report)
        return run_hours(options, team, coordinator, _speech(options, team.settings.speech))
    plan = BenchPlan(
        names=robots,
        tasks=team.tasks,
        seed=options.seed,
        coordinator=coordinator,
        team=team.settings.team,
        nearest_first=options.pick == "nearest",
        strangers=options.strangers,
        speech=_speech(options, team.settings.speech),
        talk=Talk(options.talk),
        keys=keys,
        encrypts=options.encrypted,
        unable=unable_robots(team, robots),
        skills=_skills(options, team, robots),
        air=Air(noise_db_spl=options.noise_db, muted=options.mute),
        ways=FurnishedRoom() if options.room == "furnished" else FreeField(),
        loudspeaker=USUAL if options.room == "furnished" else IDEAL,
    )
    if not options.allow_confusable:
        refuse_confusable(team)
    if options.report is not None:
        _make_directory(options.report)  # before a long mission, not after it
    with _shown(options.json) as show, pacing(options) as pace:
        bench = Bench(plan, team.sound, show, pace)
        record = bench.run()
    if options.report is not None:
        _write_report(options.report, record, bench, quiet=options.json)
    summary = next(e for e in record.events if isinstance(e, Summary))
    return EX_OK if summary.lost == 0 and summary.duplicates == 0 else EX_FAILURE


def _keys(options: argparse.Namespace) -> KeyRing | None:
    """The team's key; without a file one made from the seed, so that the mission can be repeated."""
    if options.key is None:
        return None
    if options.key == Path():
        return KeyRing(TeamKey(random.Random(options.seed).randbytes(KEY_BYTES)))
    keep_out_of_dumps()
    return read_key_file(options.key).ring(today())


def _skills(options: argparse.Namespace, team: Team, robots: tuple[str, ...]) -> dict[str, dict[str, FakeDevice]]:
    """Each robot's fake devices, as in the settings, without those that it is to lack."""
    if wrong := list(faults(team.settings, team.tasks, programs_too=False)):
        raise ConfigError("\n".join(wrong))
    whose, litres = options.tank or ("", None)
    whose = whose and taking_part(whose, robots, "--tank")
    skills = {
        name: usual_devices(team.tasks, team.settings.skills, litres if whose in ("", name) else math.inf)
        for name in robots
    }
    if options.tank is not None and not _uses_pump(team, skills[robots[0]]):
        raise ConfigError("--tank: no task uses a pump; give a skill a pin (`gpio:`) in the settings, or leave it out")
    for robot, lacked in lacked_skills(options.without, robots, skills[robots[0]], team).items():
        skills[robot] = {name: fake for name, fake in skills[robot].items() if name not in lacked}
    return skills


def _uses_pump(team: Team, skills: Mapping[str, FakeDevice]) -> bool:
    """Whether a task uses a skill that is a pump."""
    used = (action.skill for task in team.tasks.tasks for action in task.actions if isinstance(action, Use | Tend))
    return any(isinstance(skills.get(name), FakePump) for name in used)


def _speech(options: argparse.Namespace, settings: SpeechSettings) -> Speech:
    """From the options, or else from the settings."""
    usual = speech_of(settings)
    return replace(usual, slowly=options.slow or usual.slowly, times=options.repeat or usual.times)


def _coordinator(options: argparse.Namespace, robots: tuple[str, ...], settings: Settings) -> str | None:
    """Who gives the orders, by the options or else as the settings have their own robot do; None: nobody."""
    named: str | None = options.coordinator
    own = as_written(settings.name, robots)
    role = settings.mode if own is not None else "volunteer"
    if (options.mode or role) == "volunteer":
        if named:
            raise ConfigError("--coordinator: in volunteer mode nobody gives orders; add --mode coordinate")
        return None
    if len(robots) < 2:
        raise ConfigError("--mode coordinate: one robot alone has nobody to order; name at least two with --robots")
    chosen = as_written(named, robots) if named else None
    if named and chosen is None:
        raise ConfigError(f"--coordinator: {named} does not take part; choose one of {', '.join(robots)}")
    others = [robot for robot in robots if role != "follow" or robot != own]
    return chosen or (own if role == "coordinate" else others[-1])


@contextmanager
def _shown(json_lines: bool) -> Iterator[Sink]:
    """Events to the terminal or, as JSON, to standard output."""
    if json_lines:
        from hvcpd.reporting.jsonlines import JsonLines

        yield JsonLines(sys.stdout).handle
        return
    from rich.console import Console

    from hvcpd.reporting.live import LiveView

    view: LiveView | None = None

    def handle(event: Event) -> None:
        nonlocal view
        if view is not None:
            view.handle(event)
        elif isinstance(event, Started):
            view = stack.enter_context(LiveView(Console(), event))

    with ExitStack() as stack:
        yield handle


@contextmanager
def pacing(options: argparse.Namespace, backend: Any | None = None) -> Iterator[Pace]:
    """The pace of the mission: the loudspeaker's, the wall clock's, or unlimited."""
    with ExitStack() as stack:
        pace: Pace = RealTime() if options.play or options.speed == "real" else lambda _now, _sound: None
        if options.play:
            from hvcpd.hardware.audio_play import Playback

            try:
                pace = partial(_play_louder, stack.enter_context(Playback(backend=backend)))
            except DeviceError as error:
                print_note(f"note: nothing is played: {error}")
        yield pace


def _play_louder(play: Pace, now: float, sound: Samples) -> None:
    """Play the listener's sound at a level for people."""
    play(now, np.clip(sound * LISTENER_GAIN, -1.0, 1.0))


class RealTime:
    """Slows the mission down to the wall clock."""

    def __init__(self) -> None:
        self._began_s = time.monotonic()

    def __call__(self, now: float, _sound: Samples) -> None:
        ahead_s = now - (time.monotonic() - self._began_s)
        if ahead_s > 0:
            time.sleep(ahead_s)


def _make_directory(path: Path) -> None:
    with writing(path, AudioFileError, "--report: ", ANOTHER_FOLDER):
        make_writable(path)


def _write_report(directory: Path, record: MissionRecord, bench: Bench, quiet: bool) -> None:
    from hvcpd.reporting.html import write_report
    from hvcpd.reporting.transcript import write_trails, write_transcript

    with writing(directory, AudioFileError, "--report: ", ANOTHER_FOLDER):
        write_report(record, directory / "report.html")
        write_transcript(record.events, directory / "transcript.jsonl")
        write_trails(record.trails, directory / "trails.jsonl")
    write_wav(directory / "mission.wav", _audible(record.sound))
    for name, recording in bench.recordings.items():
        write_wav(directory / f"heard-by-{name}.wav", recording)
    if not quiet:
        sys.stdout.write(
            f"\nReport: {directory / 'report.html'} (open it in a browser), and beside it mission.wav, "
            "transcript.jsonl, trails.jsonl and what each robot heard.\n"
            f"To see and hear it again as it happened: hvcpctl console --replay {shlex.quote(str(directory))}\n"
        )


LISTENER_GAIN = np.float32(30.0)
"""A robot 5 m from the listener's microphone has −55 dBFS there; this brings it to −25 dBFS."""
PEAK = 0.7
"""Peak of what is played, of full scale, about −3 dBFS; the microphone's own level is too low for people."""


def _audible(sound: Samples) -> Samples:
    peak = float(np.max(np.abs(sound), initial=1e-6))
    return (sound * np.float32(PEAK / peak)).astype(np.float32)
