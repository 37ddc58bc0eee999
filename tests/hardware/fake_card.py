"""A sound card in the terms of the module sounddevice, whose interrupts the test makes."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvcpd.ports import Samples


def device(name: str, inputs: int, outputs: int, rate_hz: float = 48_000.0) -> dict[str, Any]:
    return {
        "name": name,
        "max_input_channels": inputs,
        "max_output_channels": outputs,
        "default_samplerate": rate_hz,
    }


HEADSET = device("USB Headset: Audio (hw:1,0)", 1, 2)
CAMERA = device("HD Camera: USB Audio (hw:2,0)", 2, 0)
SPEAKER = device("bcm2835 Headphones (hw:0,0)", 0, 8, 44_100.0)


@dataclass
class Status:
    """sounddevice's CallbackFlags, as far as they are looked at."""

    input_overflow: bool = False
    output_underflow: bool = False

    def __bool__(self) -> bool:
        return self.input_overflow or self.output_underflow


class FakeCard:
    """Devices, and the one stream that may be open on them."""

    class PortAudioError(Exception):
        """As sounddevice has it."""

    def __init__(
        self,
        devices: Sequence[dict[str, Any]] = (HEADSET,),
        defaults: tuple[int | None, int | None] = (0, 0),
        rates_hz: Sequence[int] = (16_000, 48_000),
    ) -> None:
        self.devices = [entry | {"index": index} for index, entry in enumerate(devices)]
        self.defaults = defaults
        self.rates_hz = rates_hz
        self.broken = False
        self.busy = False
        self.stream: FakeStream | None = None
        self.listed_afresh = 0
        self._started = threading.Event()

    def running(self, timeout_s: float) -> FakeStream:
        """The next stream that is started, once it is, for a thread that makes its interrupts."""
        assert self._started.wait(timeout_s)
        self._started.clear()
        assert self.stream is not None
        return self.stream

    def query_devices(self, device: object = None, kind: str | None = None) -> Any:
        if self.broken:
            raise self.PortAudioError("Error querying devices")
        if kind is None:
            return self.devices
        index = self.defaults[0 if kind == "input" else 1]
        if index is None:
            raise self.PortAudioError("Error querying device -1")
        return self.devices[index]

    def _terminate(self) -> None:
        assert self.stream is None or self.stream.closed, "PortAudio frees a stream that is in use"
        self.listed_afresh += 1

    def _initialize(self) -> None:
        if self.broken:
            raise self.PortAudioError("Unanticipated host error [PaErrorCode -9999]")

    def check_input_settings(self, device: int, channels: int, dtype: str, samplerate: int) -> None:
        assert self.devices[device]["max_input_channels"] >= channels
        self._check(samplerate)

    def check_output_settings(self, device: int, channels: int, dtype: str, samplerate: int) -> None:
        assert self.devices[device]["max_output_channels"] >= channels
        self._check(samplerate)

    def _check(self, rate_hz: int) -> None:
        if rate_hz not in self.rates_hz:
            raise self.PortAudioError("Invalid sample rate [PaErrorCode -9997]")

    def Stream(self, **options: Any) -> FakeStream:
        return self._open(options)

    def OutputStream(self, **options: Any) -> FakeStream:
        self._check(options["samplerate"])
        return self._open(options)

    def _open(self, options: dict[str, Any]) -> FakeStream:
        if self.busy:
            raise self.PortAudioError("Device unavailable [PaErrorCode -9985]")
        self.stream = FakeStream(self, options)
        return self.stream


@dataclass
class FakeStream:
    """An open stream; `interrupt` is one call of PortAudio's callback."""

    card: FakeCard
    options: dict[str, Any]
    latency: tuple[float, float] = (0.02, 0.03)
    active: bool = False
    closed: bool = False
    stopped: bool = False
    gone: bool = False
    played: list[Samples] = field(default_factory=list)

    def start(self) -> None:
        if self.gone:
            raise self.card.PortAudioError("Device unavailable")
        self.active = True
        self.card._started.set()

    def stop(self) -> None:
        self.stopped = True
        self.active = False

    def close(self, ignore_errors: bool = True) -> None:
        self.closed = True
        self.active = False

    def write(self, samples: Any) -> None:
        if self.gone:
            raise self.card.PortAudioError("Stream is stopped")
        assert samples.dtype == np.float32
        assert samples.shape[1] == 1
        self.played.append(samples[:, 0])

    def interrupt(self, heard: Samples, status: Status | None = None) -> Samples:
        """The card has taken `heard` and wants as much to play."""
        assert self.active
        callback: Callable[..., None] = self.options["callback"]
        out = np.full((len(heard), 1), np.nan, np.float32)
        callback(heard[:, None].copy(), out, len(heard), None, status or Status())
        assert not np.isnan(out).any(), "the callback must fill the whole block"
        self.played.append(out[:, 0])
        return out[:, 0]

    def die(self) -> None:
        """The device is pulled out."""
        self.active = False
        self.options["finished_callback"]()
