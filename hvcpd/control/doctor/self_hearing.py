"""Has the robot say a phrase and listen to itself; reports the recorded level and what was understood."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.config.settings import AudioSettings
from hvcpd.control.simulate.team import Team
from hvcpd.hardware.acoustics import Echo, Response, clipped_share, find_echo, find_response, level_dbfs
from hvcpd.hardware.audio_exchange import SoundStream
from hvcpd.language.messages import Free, Utterance
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.recognition.events import Recognised

SETTLE_S = 0.5
"""Ignored at the beginning, because sound cards click and adapt when they are opened."""
QUIET_S = 2.0
"""Silence before the phrase, for the noise floor."""
AFTER_S = 1.5
"""Silence after the phrase: sound servers delay by less than half a second, and the recogniser waits for the end."""

MakeStream = Callable[[AudioSettings], SoundStream]


@dataclass(frozen=True)
class SelfHearing:
    """One round of it. `echo` is None if the microphone did not take the own words; `said` is None if none were."""

    floor_dbfs: float
    clipped: float
    lost: int
    """Samples that the card or the computer lost in this round."""
    said: str | None = None
    echo: Echo | None = None
    understood: bool = False
    confidence: float = 0.0
    response: Response | None = None
    """The loudspeaker's response, through the robot's own microphone; None if too little was heard."""


def calibration_path(team: Team) -> Path:
    """Where `hvcpctl calibrate` keeps what it found, beside the robot's memory."""
    return team.settings.state_dir / "calibration.json"


def listen(settings: AudioSettings, make_stream: MakeStream) -> SelfHearing:
    """Only listen. Raises DeviceError."""
    heard, lost = asyncio.run(exchange(make_stream(settings), np.zeros(0, np.float32)))
    return SelfHearing(level_dbfs(heard), clipped_share(heard), lost)


def hear_oneself(team: Team, make_stream: MakeStream) -> SelfHearing:
    """Say "I am free", which changes nothing for robots that hear it, and listen. Raises DeviceError."""
    name = team.settings.name
    utterance = Utterance(name, statement=Free())
    words = team.phrasebook.render(utterance)
    sound = team.sound.speaker_of(name).render(team.phrasebook.phrases(utterance))
    recogniser = make_speech_recogniser(team.phrasebook, (name,), team.sound)
    heard, lost = asyncio.run(exchange(make_stream(team.settings.audio), sound))
    quiet = heard[: samples_in(QUIET_S)]
    events = [event for event in recogniser.push(heard) if isinstance(event, Recognised)]
    right = [event.confidence for event in events if tuple(event.words) == tuple(words)]
    echo = find_echo(sound, heard[len(quiet) :], quiet)
    back = heard[len(quiet) + samples_in(echo.delay_s) :] if echo is not None else quiet[:0]
    return SelfHearing(
        level_dbfs(quiet),
        clipped_share(heard),
        lost,
        team.phrasebook.write(utterance),
        echo,
        bool(right),
        max(right, default=0.0),
        find_response(sound, back),
    )


async def exchange(
    stream: SoundStream, sound: Samples, after_s: float = AFTER_S, settled: Callable[[], object] | None = None
) -> tuple[Samples, int]:
    """Listen for QUIET_S, play, listen for `after_s`; returns the sound since SETTLE_S, and the number of lost samples.
    `settled` is called when that sound begins."""
    total = samples_in(SETTLE_S + QUIET_S + after_s) + len(sound)
    silent = samples_in(SETTLE_S + QUIET_S)
    script = np.zeros(total, np.float32)
    script[silent : silent + len(sound)] = sound
    taken: list[Samples] = []
    n_taken = 0
    try:
        await stream.open()
        await stream.start()
        while n_taken < total:
            block = await stream.read()
            if settled is not None and n_taken <= SETTLE_S * SAMPLE_RATE_HZ < n_taken + len(block):
                settled()
            taken.append(block)
            piece = script[n_taken : n_taken + len(block)]
            stream.write(np.concatenate([piece, np.zeros(len(block) - len(piece), np.float32)]))
            n_taken += len(block)
        counters = stream.counters
    finally:
        await stream.close()
    heard = np.concatenate(taken)[samples_in(SETTLE_S) :]
    return heard, counters.input_dropped + counters.output_late + counters.card_overflows
