"""`hvcpctl stop-test`: whether and how soon calls of "stop" are heard in the user's room."""

from __future__ import annotations

import argparse
import asyncio
import random
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.control.doctor.self_hearing import QUIET_S, exchange
from hvcpd.control.live.daemon_client import running_robot
from hvcpd.control.output import print_note, show
from hvcpd.control.simulate.team import Team, load_team
from hvcpd.daemon.devices import Devices
from hvcpd.errors import EX_FAILURE, EX_OK
from hvcpd.evaluation.statistics import wilson
from hvcpd.hardware.acoustics import find_echo
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.recognition.events import Event, Held, Recognised, Urgent
from hvcpd.recognition.frontend import frame_powers
from hvcpd.synthesis.leveling import audible

LOUDNESSES_DB = (-40.0, -30.0, -20.0, -10.0, 0.0)
"""Peak levels relative to the loudspeaker's full scale: from a murmur to a shout, at any volume setting."""
WAYS = ("quietly", "as you talk", "loudly")
"""The ways in which people are asked to call."""
IN_TIME_S = 0.5
SOONEST_S = 1.0
"""A halt earlier than this before the call's end has another cause; the word lasts half a second."""
DECIDED_S = 3.0
"""Time after the call within which an uncertain word is decided."""
ASKED_S = 4.0
LEAST_OVER_DB = 10.0
"""A call is at least this much louder than the room; steady noise varies by less from frame to frame."""
CLOSURE_S = 0.2
"""Longest silence within the word: the lips are closed before its last sound."""
FRAME = 320
"""Samples, 20 ms."""
BLOCK = 400
"""Samples, 25 ms, as the daemon has it."""


@dataclass(frozen=True)
class Call:
    """One call; `over_noise_db` is None if it did not arrive. Times are from its end, s; None: never."""

    how: str
    over_noise_db: float | None
    halted_s: float | None = None
    stopped_s: float | None = None

    @property
    def in_time(self) -> bool:
        """Whether the robot stood soon enough."""
        return self.halted_s is not None and self.halted_s <= IN_TIME_S


def run(options: argparse.Namespace, devices: Devices | None = None) -> int:
    """Report each call; then the conclusion, and its limits."""
    where, team = devices or Devices(), load_team(options)
    name = running_robot(team.settings.name, options)
    if name is not None:  # a sound server lets both have the card
        print_note(f"{name} runs now: it hears the calls, and its talk disturbs; end it first")
    found = list(_printed(_asked(team, where, options) if options.ask else _played(team, where, options), options.json))
    _tell_verdict(found, options)
    return EX_OK if all(call.in_time for call in found) else EX_FAILURE


def _played(team: Team, devices: Devices, options: argparse.Namespace) -> Iterator[Call]:
    """Calls in voices of the synthesizer that no robot of the team has, if there are any."""
    audio, chooser = team.settings.audio, random.Random(1)
    audio = replace(audio, output_device=options.output or audio.output_device)
    robots = {team.sound.voice_of(name).name for name in team.names}
    every = team.sound.every_voice()
    voices = [voice for voice in every if voice.name not in robots] or every
    for level_db in LOUDNESSES_DB:
        for _ in range(options.times):
            call = team.sound.speaker_in(chooser.choice(voices)).render([["stop"]])
            begin, end = audible(call)
            call = np.asarray(call[begin:end] * (10.0 ** (level_db / 20.0) / np.abs(call).max()), np.float32)
            heard, _ = asyncio.run(exchange(devices.make_stream(audio), call, DECIDED_S))
            quiet = samples_in(QUIET_S)
            echo = find_echo(call, heard[quiet:], heard[:quiet])
            if echo is None:
                yield Call(f"{level_db:+.0f} dB", None)
                continue
            ended_s = QUIET_S + echo.delay_s + len(call) / SAMPLE_RATE_HZ
            yield judged(team, f"{level_db:+.0f} dB", heard, ended_s, echo.snr_db)


def _asked(team: Team, devices: Devices, options: argparse.Namespace) -> Iterator[Call]:
    """Calls by the person at the terminal."""
    for way in WAYS:
        for number in range(options.times):
            prompt = f'Say "stop" {way}, once, in the next {ASKED_S:.0f} s ({number + 1} of {options.times})\n'
            silence = np.zeros(samples_in(ASKED_S - QUIET_S), np.float32)
            stream = devices.make_stream(team.settings.audio)
            heard, _ = asyncio.run(exchange(stream, silence, DECIDED_S, partial(sys.stderr.write, prompt)))
            voice = voice_in(heard)
            yield judged(team, way, heard, *voice) if voice is not None else Call(way, None)


def voice_in(heard: Samples) -> tuple[float, float] | None:
    """The end of the speech in a recording, shape (n,), in s, and its level above the rest, in dB; None if nobody
    spoke. A tap or a click before or after the word is shorter."""
    power = frame_powers(heard - np.median(heard), FRAME)  # a microphone's offset is no noise
    floor = max(float(np.median(power)), 1e-12)
    loud = np.flatnonzero(power >= floor * 10.0 ** (LEAST_OVER_DB / 10.0))
    if not len(loud):
        return None
    sounds = np.split(loud, np.flatnonzero(np.diff(loud) * FRAME > CLOSURE_S * SAMPLE_RATE_HZ) + 1)
    word = max(sounds, key=len)
    return float(word[-1] + 1) * FRAME / SAMPLE_RATE_HZ, float(10.0 * np.log10(power[word].mean() / floor))


def judged(team: Team, how: str, heard: Samples, ended_s: float, over_noise_db: float) -> Call:
    """The reaction of a robot of the team to this sound, shape (n,), with a call that ends then."""
    recogniser = make_speech_recogniser(team.phrasebook, team.names, team.sound)
    halts, stops = [], []
    for start in range(0, len(heard), BLOCK):
        after_s = (start + BLOCK) / SAMPLE_RATE_HZ - ended_s
        for event in recogniser.push(heard[start : start + BLOCK]):
            halts += [after_s] if isinstance(event, Held) or _is_stop(event) else []
            stops += [after_s] if _is_stop(event) else []
    halted, stopped = ([after_s for after_s in each if after_s > -SOONEST_S] for each in (halts, stops))
    return Call(how, round(over_noise_db, 1), _first(halted), _first(stopped))


def _is_stop(event: Event) -> bool:
    return isinstance(event, Urgent) or (isinstance(event, Recognised) and "stop" in event.words)


def _first(times_s: Sequence[float]) -> float | None:
    return round(min(times_s), 3) if times_s else None


def _printed(calls: Iterator[Call], as_json: bool) -> Iterator[Call]:
    """Report each call as it comes."""
    for number, call in enumerate(calls):
        if not number and not as_json:
            sys.stdout.write("call          over the noise  halted after  for good\n")
        over = "did not arrive" if call.over_noise_db is None else f"{call.over_noise_db:.0f} dB"
        halted = "not" if call.halted_s is None else f"{max(call.halted_s, 0.0):.2f} s"
        stopped = "yes" if call.stopped_s is not None else "no"
        show(as_json, asdict(call), f"{call.how:12}  {over:14}  {halted:12}  {stopped}")
        yield call


def _tell_verdict(calls: Sequence[Call], options: argparse.Namespace) -> None:
    """The results and their limits."""
    arrived = [call for call in calls if call.over_noise_db is not None]
    in_time, for_good = sum(call.in_time for call in calls), sum(call.stopped_s is not None for call in calls)
    low, high = wilson(in_time, len(calls))
    counts = {"calls": len(calls), "arrived": len(arrived), "in_time": in_time, "for_good": for_good}
    who = "This was you, here and now" if options.ask else "These were synthetic voices; people sound different (--ask)"
    if not (options.ask or options.output):
        who += ". They came from the robot's own loudspeaker; people stand farther away (--output)"
    if not arrived:
        who += ". Is it the right microphone, and is all loud enough? `hvcpctl doctor --only sound` looks"
    show(
        options.json,
        counts | {"least_share": round(low, 3), "most_share": round(high, 3)},
        f"{in_time} of {len(calls)} calls halted the robot within {IN_TIME_S} s ({100 * low:.0f} to {100 * high:.0f} % "
        f"with a certainty of 95 %), {for_good} for good; {len(calls) - len(arrived)} did not arrive.",
        f"{who}. A call that halts it without a latch lets it go on after 2 s, unless it is said again.",
        "A voice is not a safety device: if a robot can do harm, install a switch that cuts the motors' power.",
    )
