"""Takes sound from a microphone for the commands that only listen (the daemon has `AudioStream`)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from hvcpd.config.settings import AudioSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio import load_backend
from hvcpd.hardware.audio_card import Microphone
from hvcpd.ports import Samples

Block = tuple[Samples, int | None]
"""Samples of shape (n,), float32, 16 kHz, and how many the card lost before them, None if none."""


@contextmanager
def capture(settings: AudioSettings, backend: Any | None = None) -> Iterator[Iterator[Block]]:
    """Record from now on, block by block. `backend` replaces the module sounddevice.

    Raises DeviceError when there is no microphone, it is in use, or it goes away.
    """
    backend = backend if backend is not None else load_backend()
    microphone = Microphone(backend, settings)
    name = microphone.opened.device.name
    try:
        microphone.stream.start()
        yield iter(microphone.read, None)
    except backend.PortAudioError as error:
        raise DeviceError(f"the microphone {name!r} is gone ({error}); plug it in, and start again") from error
    finally:
        microphone.stream.close(True)
