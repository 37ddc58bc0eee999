"""Raw sound to and from a PulseAudio server, blocking: the library's "simple" API by ctypes.

Reference: PulseAudio 16, `pulse/simple.h`, `pulse/def.h`, `pulse/sample.h`. Sound is 16 kHz, mono, 16 bit.
"""

from __future__ import annotations

import ctypes
from ctypes import POINTER, Structure, byref, c_char_p, c_int, c_size_t, c_uint8, c_uint32, c_void_p
from typing import Literal

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

LIBRARY = "libpulse-simple.so.0"
"""In Debian's package libpulse0."""

_S16LE = 3
_PLAYBACK, _RECORD = 1, 2
_SAMPLE_BYTES = 2
_FULL_SCALE = 32768.0
_DEFAULT = 2**32 - 1
"""In a buffer's attributes: the server's choice."""


Direction = Literal["play", "record"]


class _SampleSpec(Structure):
    _fields_ = (("format", c_int), ("rate", c_uint32), ("channels", c_uint8))


class _BufferAttributes(Structure):
    _fields_ = tuple((name, c_uint32) for name in ("maxlength", "tlength", "prebuf", "minreq", "fragsize"))


class PipeError(Exception):
    """The server, or the device on it, is missing or no longer there."""


def load() -> ctypes.CDLL:
    """The library with its functions declared. Raises OSError where it is not installed."""
    library = ctypes.CDLL(LIBRARY)
    library.pa_simple_new.restype = c_void_p
    library.pa_simple_new.argtypes = (
        *(c_char_p, c_char_p, c_int, c_char_p, c_char_p),
        *(POINTER(_SampleSpec), c_void_p, POINTER(_BufferAttributes), POINTER(c_int)),
    )
    library.pa_simple_free.restype = None
    library.pa_simple_free.argtypes = (c_void_p,)
    for function in (library.pa_simple_read, library.pa_simple_write):
        function.restype = c_int
        function.argtypes = (c_void_p, c_void_p, c_size_t, POINTER(c_int))
    library.pa_strerror.restype = c_char_p
    library.pa_strerror.argtypes = (c_int,)
    return library


class PulsePipe:
    """One stream from a source ("record") or to a sink ("play") of the server at the socket `server`.

    `latency_s` is how much sound should wait in the server. Raises PipeError, as every method does, and OSError where
    the library is missing. A context manager.
    """

    def __init__(self, server: str, direction: Direction, device: str, latency_s: float) -> None:
        self._library = load()
        error = c_int()
        size = round(latency_s * SAMPLE_RATE_HZ) * _SAMPLE_BYTES
        self._stream = self._library.pa_simple_new(
            f"unix:{server}".encode(),
            b"air",
            _PLAYBACK if direction == "play" else _RECORD,
            device.encode(),
            direction.encode(),
            byref(_SampleSpec(_S16LE, SAMPLE_RATE_HZ, 1)),
            None,
            byref(_BufferAttributes(_DEFAULT, size, _DEFAULT, _DEFAULT, size)),
            byref(error),
        )
        if not self._stream:
            raise self._failure(f"{device} on {server} does not open", error)

    def __enter__(self) -> PulsePipe:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def read(self, n: int) -> Samples:
        """Wait for the next samples and return them, shape (n,), float32."""
        data = np.zeros(n, "<i2")
        self._exchange(self._library.pa_simple_read, data)
        return (data / _FULL_SCALE).astype(np.float32)

    def write(self, samples: Samples) -> None:
        """Have samples (float, shape (n,)) played, clipped at full scale; waits while the server's buffer is full."""
        scaled = np.rint(np.asarray(samples, np.float64) * _FULL_SCALE)
        self._exchange(self._library.pa_simple_write, np.clip(scaled, -_FULL_SCALE, _FULL_SCALE - 1).astype("<i2"))

    def close(self) -> None:
        """Let go of the stream; safe to call twice."""
        if self._stream:
            self._library.pa_simple_free(self._stream)
            self._stream = None

    def _exchange(self, function: ctypes._NamedFuncPointer, data: np.ndarray[tuple[int], np.dtype[np.int16]]) -> None:
        error = c_int()
        if function(self._stream, data.ctypes.data, data.nbytes, byref(error)) < 0:
            raise self._failure("the stream ended", error)

    def _failure(self, what: str, error: c_int) -> PipeError:
        return PipeError(f"{what}: {self._library.pa_strerror(error).decode()}")
