"""Plays sound through a loudspeaker for the commands (the daemon has `AudioStream`)."""

from __future__ import annotations

from types import TracebackType
from typing import Any

import numpy as np

from hvcpd.errors import DeviceError
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

REMEDY = "write a file instead (see --help), or see which devices there are: python -m sounddevice"


def load_sounddevice() -> Any:
    """The sounddevice module. Raises DeviceError when it or PortAudio is missing."""
    try:
        import sounddevice
    except (ImportError, OSError) as error:
        raise DeviceError(f"no sound: {error}; install it: sudo apt install libportaudio2") from None
    return sounddevice


def play(samples: Samples, device: str | None = None) -> None:
    """Play to the end. Raises DeviceError when there is no loudspeaker."""
    with Playback(device) as player:
        player(0.0, samples)


class Playback:
    """A loudspeaker that blocks until what it is given is nearly played, and so keeps its own pace."""

    def __init__(self, device: str | None = None) -> None:
        self._device = device
        self._stream: Any = None

    def __enter__(self) -> Playback:
        sounddevice = load_sounddevice()
        try:
            self._stream = sounddevice.OutputStream(
                samplerate=SAMPLE_RATE_HZ, channels=1, dtype="float32", device=self._device
            )
            self._stream.start()
        except (sounddevice.PortAudioError, ValueError) as error:
            raise DeviceError(f"no loudspeaker: {error}; {REMEDY}") from None
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._stream is not None:
            self._stream.stop()
            self._stream.close()

    def __call__(self, _now: float, samples: Samples) -> None:
        self._stream.write(np.ascontiguousarray(samples, dtype=np.float32).reshape(-1, 1))
