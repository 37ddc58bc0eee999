"""Plays sound through a loudspeaker for the commands (the daemon has `AudioStream`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hvcpd.errors import DeviceError
from hvcpd.hardware.audio import find_device, load_backend
from hvcpd.hardware.audio_card import MOST_OUTPUTS, fit
from hvcpd.hardware.audio_resample import StreamResampler
from hvcpd.ports import SAMPLE_RATE_HZ, Samples


def play(samples: Samples, device: str | None = None, backend: Any | None = None) -> None:
    """Play sound, shape (n,), float32, to the end. Raises DeviceError when there is no loudspeaker."""
    with Playback(device, backend) as player:
        player(0.0, samples)


class Playback:
    """A loudspeaker whose `write` blocks until the sound is nearly played, and so sets the pace.

    `device` is a part of its name, None the system's default; `backend` stands in for the module sounddevice.
    """

    def __init__(self, device: str | None = None, backend: Any | None = None) -> None:
        self._device = device
        self._backend = backend
        self._stream: Any = None
        self._channels = 1
        self._to_card = StreamResampler(SAMPLE_RATE_HZ, SAMPLE_RATE_HZ)

    def __enter__(self) -> Playback:
        """Open and start. Raises DeviceError."""
        backend = self._backend = self._backend if self._backend is not None else load_backend()
        loudspeaker = find_device(backend, "output", self._device)
        opened = fit(backend.check_output_settings, backend, loudspeaker, (1, min(MOST_OUTPUTS, loudspeaker.outputs)))
        self._channels = opened.channels
        self._to_card = StreamResampler(SAMPLE_RATE_HZ, opened.rate_hz)
        try:
            self._stream = backend.OutputStream(
                samplerate=opened.rate_hz, channels=opened.channels, dtype="float32", device=loudspeaker.index
            )
            self._stream.start()
        except (backend.PortAudioError, ValueError) as error:
            raise DeviceError(
                f"{loudspeaker.name!r} cannot be opened ({error}); is another program using it? "
                "`arecord -l` and `aplay -l` list what there is"
            ) from error
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Play what waits, unless there was an error, and let go of the device."""
        if self._stream is None:
            return
        try:
            if kind is None:  # the conversion still holds the last milliseconds
                self(0.0, np.zeros(math.ceil(self._to_card.delay_s * SAMPLE_RATE_HZ), np.float32))
                self._try(self._stream.stop)
        finally:
            stream, self._stream = self._stream, None
            self._try(lambda: stream.close(True))

    def __call__(self, _now: float, samples: Samples) -> None:
        """Play samples of shape (n,), float32. Raises DeviceError when the loudspeaker is gone."""
        sound = self._to_card.push(np.asarray(samples, np.float32))
        if sound.size:
            frames = np.repeat(sound.reshape(-1, 1), self._channels, axis=1)
            self._try(lambda: self._stream.write(frames))

    def _try(self, action: Any) -> None:
        backend: Any = self._backend
        try:
            action()
        except backend.PortAudioError as error:
            raise DeviceError(f"the loudspeaker stopped ({error}); is it still connected?") from error
