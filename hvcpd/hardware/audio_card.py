"""A microphone and a loudspeaker of PortAudio at whatever rate and with whatever channels they have; mono here, 16 kHz.

Two streams, read and written in turn with blocking calls by one thread: the microphone keeps the pace, and how full the
loudspeaker's buffer is tells how the two clocks run against each other. So they may be two cards of different rates.
Why no callbacks: docs/decisions/sound-thread.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from hvcpd.config.settings import AudioSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio import SoundDevice, find_device
from hvcpd.hardware.audio_losses import CaptureClock
from hvcpd.hardware.audio_resample import StreamResampler
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

OTHER_RATES_HZ = (48_000, 44_100, 32_000, 96_000)
"""Tried after 16 kHz and the card's own; what USB microphones and boards for the Raspberry Pi have."""
MOST_OUTPUTS = 2
"""Most channels on which the voice is played: both loudspeakers of a pair. Beyond them are those of a cinema."""
BUFFER_BLOCKS = 3
"""Asked of the loudspeaker's buffer. With 4, PulseAudio takes two blocks at a time, all that is kept, and every block
that comes a little late leaves a gap: 20 in 40 s on a computer with much to do. With 3 it takes one: 2 gaps."""
FILLED_BLOCKS = 2
"""Kept in it, so that the thread may be late by as much, and the buffer take as much, before a sample is lost."""
WATCHED_BLOCKS = 40
"""Number of blocks over which the filling is averaged: sound servers take what waits in lumps of a block and more."""
BEHIND_BLOCKS = 2
"""Number of blocks that, still unread, mean that the microphone is behind: after a stall a sound server delivers all
that it has kept."""
SLACK_BLOCKS = 0.75
"""Largest error of the mean filling that is left alone; beyond it silence is left out or added. 19 ms of 25 ms blocks,
which two clocks 100 ppm apart need three minutes for."""
PATIENCE_S = 15.0
"""Longest wait for silence; then sound is left out, or silence added, within words. Sentences take 12 s."""


@dataclass(frozen=True)
class Opened:
    """How a device was opened."""

    device: SoundDevice
    rate_hz: int
    channels: int


class Microphone:
    """One channel of an input device. Raises the backend's PortAudioError when the device is gone."""

    def __init__(self, backend: Any, settings: AudioSettings, clock: Callable[[], float] = time.monotonic) -> None:
        """Open, still silent. Raises DeviceError."""
        device = find_device(backend, "input", settings.input_device)
        self._channel = settings.input_channel
        if self._channel > device.inputs:
            raise DeviceError(
                f"audio.input_channel: {device.name!r} has {device.inputs} channel{'s' * (device.inputs != 1)}, "
                f"not {self._channel}"
            )
        self.opened = fit(backend.check_input_settings, backend, device, (self._channel, device.inputs))
        self._frames = round(self.opened.rate_hz * settings.block_ms / 1000)
        self._to_ours = StreamResampler(self.opened.rate_hz, SAMPLE_RATE_HZ)
        self._clock = CaptureClock(self.opened.rate_hz, clock)
        self.stream = _open(backend, backend.InputStream, self.opened, self._frames)

    @property
    def latency_s(self) -> float:
        """The delay of the buffer, as the card reports it, and of the conversion, s."""
        return float(self.stream.latency) + self._to_ours.delay_s

    @property
    def behind(self) -> bool:
        """Whether older sound still waits to be read."""
        return bool(self.stream.read_available >= BEHIND_BLOCKS * self._frames)

    def read(self) -> tuple[Samples, int | None]:
        """Wait for the next block and return it, shape (n,), float32 at 16 kHz, with how much the card lost before
        it, None if nothing. What is no finite number is silence, as of a microphone that is mute."""
        frames, overflowed = self.stream.read(self._frames)
        lost = self._clock.block(len(frames), self.stream.read_available, bool(overflowed))
        channel = frames[:, self._channel - 1]
        sound = self._to_ours.push(np.where(np.isfinite(channel), channel, 0.0).astype(np.float32))
        return sound, round(lost * SAMPLE_RATE_HZ / self.opened.rate_hz) if overflowed else None


class Loudspeaker:
    """All channels, as far as MOST_OUTPUTS, of an output device. Raises the backend's PortAudioError when it is gone.

    `count` is told of silence that was left out or added ("clock_dropped", "clock_inserted"; samples of 16 kHz).
    """

    def __init__(self, backend: Any, settings: AudioSettings, count: Callable[[str, int], None]) -> None:
        """Open, still silent. Raises DeviceError."""
        device = find_device(backend, "output", settings.output_device)
        self.opened = fit(backend.check_output_settings, backend, device, (min(MOST_OUTPUTS, device.outputs), 1))
        self._frames = round(self.opened.rate_hz * settings.block_ms / 1000)
        self._to_card = StreamResampler(SAMPLE_RATE_HZ, self.opened.rate_hz)
        buffer_s = BUFFER_BLOCKS * settings.block_ms / 1000
        self.stream = _open(backend, backend.OutputStream, self.opened, self._frames, latency=buffer_s)
        self._count = count
        self._room = 0
        self._level: list[int] = []
        self._owed = 0
        self._waited = 0

    @property
    def latency_s(self) -> float:
        """The delay of the sound in the card's buffer, which varies around its target, and of the conversion, s."""
        return (FILLED_BLOCKS * self._frames - self._owed) / self.opened.rate_hz + self._to_card.delay_s

    def start(self) -> None:
        """Begin to play, with silence."""
        self.stream.start()
        self._room = self.stream.write_available
        self._put(np.zeros(min(FILLED_BLOCKS * self._frames, self._room), np.float32))

    def write(self, samples: Samples, behind: bool = False) -> bool:
        """Play sound, shape (n,), float32 at 16 kHz; return whether there was an underrun before.

        Waits for room, unless the microphone is `behind`: then the sound, which answers to old sound, is left out;
        otherwise all that follows would come late for ever.
        """
        sound = self._to_card.push(samples)
        if behind and self.stream.write_available < sound.size:
            self._count("output_late", samples.size)
            return False
        self._waited = self._waited + sound.size if self._owed else 0
        if self._owed and (not sound.any() or self._waited > PATIENCE_S * self.opened.rate_hz):
            sound = self._pay(sound)
        underflowed = self._put(sound)
        self._watch()
        return underflowed

    def _put(self, sound: Samples) -> bool:
        frames = np.repeat(sound[:, None], self.opened.channels, axis=1)
        return bool(self.stream.write(frames)) if sound.size else False

    def _watch(self) -> None:
        """Once in a while compare how full the buffer is with how full it should be."""
        self._level.append(self._room - self.stream.write_available)
        if len(self._level) < WATCHED_BLOCKS:
            return
        stray = sum(self._level) / len(self._level) - FILLED_BLOCKS * self._frames
        self._level.clear()
        self._owed = -round(stray) if abs(stray) > SLACK_BLOCKS * self._frames else 0

    def _pay(self, sound: Samples) -> Samples:
        """Add the silence that the buffer lacks, or leave out what is too much."""
        ours = SAMPLE_RATE_HZ / self.opened.rate_hz
        if self._owed > 0:
            sound = np.concatenate([np.zeros(self._owed, np.float32), sound])
            self._count("clock_inserted", round(self._owed * ours))
            self._owed = 0
        else:
            left_out = min(-self._owed, sound.size)
            sound = sound[left_out:]
            self._count("clock_dropped", round(left_out * ours))
            self._owed += left_out
        self._level.clear()
        return sound


def fit(check: Callable[..., None], backend: Any, device: SoundDevice, channels: tuple[int, ...]) -> Opened:
    """The first way to open the device that it agrees to. Raises DeviceError."""
    reason: Exception | None = None
    for rate_hz in _rates(device):
        for count in dict.fromkeys(channels):
            try:
                check(device=device.index, channels=count, dtype="float32", samplerate=rate_hz)
            except (backend.PortAudioError, ValueError) as error:
                reason = reason or error
            else:
                return Opened(device, rate_hz, count)
    raise DeviceError(
        f"{device.name!r} can do none of {', '.join(map(str, _rates(device)))} Hz ({reason}); is another program using "
        "it? Else choose a device that converts, such as 'default' or 'pulse'"
    ) from reason


def _rates(device: SoundDevice) -> Iterator[int]:
    yield from dict.fromkeys((SAMPLE_RATE_HZ, round(device.rate_hz), *OTHER_RATES_HZ))


def _open(backend: Any, make: Callable[..., Any], opened: Opened, frames: int, **options: Any) -> Any:
    try:
        return make(
            samplerate=opened.rate_hz,
            blocksize=frames,
            device=opened.device.index,
            channels=opened.channels,
            dtype="float32",
            **options,
        )
    except (backend.PortAudioError, ValueError) as error:
        raise DeviceError(f"{opened.device.name!r} cannot be opened ({error}); is another program using it?") from error
