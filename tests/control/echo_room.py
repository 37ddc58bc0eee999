"""A sound card in virtual time whose microphone hears its loudspeaker: delayed, weakened, in noise, clipped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hil_fakes.loudspeakers import IDEAL, Loudspeaker, Playing
from hvcpd.config.settings import AudioSettings
from hvcpd.daemon.devices import Devices
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.ports import Samples
from tests.hardware.fake_card import HEADSET, FakeCard

BLOCK = 400
"""Samples, 25 ms."""


@dataclass
class EchoRoom:
    """One card; `gain` is from the loudspeaker's samples to the microphone's, 0 if either is switched off."""

    gain: float = 0.3
    noise_rms: float = 0.001
    delay: int = 1234
    microphone_db: float = 0.0
    loudspeaker: Loudspeaker = IDEAL
    card: FakeCard = field(default_factory=lambda: FakeCard([HEADSET]))

    @property
    def devices(self) -> Devices:
        return Devices(lambda: self.card, lambda settings: EchoStream(settings, self))

    def amixer(self, command: Sequence[str]) -> str:
        """A mixer with one control, in steps of 1.5 dB from -30 to +30 dB, which is the microphone's gain."""
        assert command[0] == "amixer"
        if "sset" in command:
            wanted = float(command[-1].removesuffix("dB"))
            self.microphone_db = min(max(round(wanted / 1.5) * 1.5, -30.0), 30.0)
        if "scontrols" in command:
            return "Simple mixer control 'Speaker',0\nSimple mixer control 'Mic',0\n"
        return f"  Mono: Capture 12 [50%] [{self.microphone_db:.2f}dB] [on]\n"

    def heard(self, played: Samples, noise: Samples) -> Samples:
        amplitude = 10.0 ** (self.microphone_db / 20.0)
        taken: Samples = np.clip(amplitude * (self.gain * played + self.noise_rms * noise), -1.0, 1.0)
        return taken


class EchoStream:
    """As `AudioStream`; a block takes no time."""

    latency_s = 0.0

    def __init__(self, _settings: AudioSettings, room: EchoRoom) -> None:
        self.counters = StreamCounters()
        self._room = room
        self._rng = np.random.default_rng(1)
        self._played = np.zeros(room.delay, np.float32)
        self._cone = Playing(room.loudspeaker)

    async def open(self, afresh: bool = False) -> None:
        """Nothing to open."""

    async def start(self) -> None:
        """Nothing to start."""

    async def read(self) -> Samples:
        now, self._played = self._played[:BLOCK], self._played[BLOCK:]
        now = np.concatenate([now, np.zeros(BLOCK - len(now), np.float32)])
        now = self._cone.play(now).astype(np.float32)
        noise = self._rng.standard_normal(BLOCK).astype(np.float32)
        return self._room.heard(now, noise).astype(np.float32)

    def write(self, samples: Samples) -> None:
        self._played = np.concatenate([self._played, samples])

    async def close(self) -> None:
        """Nothing to close."""
