"""A sound card in the terms of the module sounddevice, whose interrupts the test makes."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
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
    """Devices, and the streams that are open on them, one to hear and one to play.

    `interrupt` is the clock: each call gives the microphone a block and plays as much from the loudspeaker's buffer.
    `skew` makes the loudspeaker play more (or fewer) frames than that at each call, as another clock would.
    """

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
        self.initialised = True
        self.busy = False
        self.refuses_to_start = False
        self.hangs: threading.Event | None = None
        self.buffer_frames: int | None = None
        self.inputs: list[FakeInput] = []
        self.outputs: list[FakeOutput] = []
        self.listed_afresh = 0
        self.change = threading.Condition()

    @property
    def stream(self) -> FakeStream:
        """The last stream that was opened."""
        return self.outputs[-1] if self.outputs else self.inputs[-1]

    @property
    def played(self) -> list[Samples]:
        """What the last loudspeaker was given, block by block; its first channel."""
        return self.outputs[-1].played

    def running(self, timeout_s: float, streams: int = 1) -> None:
        """Wait until so many microphones have been started in all and the last one is waited for."""
        with self.change:
            assert self.change.wait_for(lambda: len(self.inputs) >= streams and self.inputs[-1].waiting, timeout_s), (
                "nobody listens"
            )

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
        assert all(stream.closed for stream in (*self.inputs, *self.outputs)), "PortAudio frees what is in use"
        if not self.initialised:
            raise self.PortAudioError("PortAudio not initialized [PaErrorCode -10000]")
        self.initialised = False
        self.listed_afresh += 1

    def _initialize(self) -> None:
        if self.broken:
            raise self.PortAudioError("Unanticipated host error [PaErrorCode -9999]")
        self.initialised = True

    def check_input_settings(self, device: int, channels: int, dtype: str, samplerate: int) -> None:
        assert self.devices[device]["max_input_channels"] >= channels
        self._check(device, samplerate)

    def check_output_settings(self, device: int, channels: int, dtype: str, samplerate: int) -> None:
        assert self.devices[device]["max_output_channels"] >= channels
        if channels < self.devices[device].get("least_outputs", 1):
            raise self.PortAudioError("Invalid number of channels [PaErrorCode -9998]")
        self._check(device, samplerate)

    def _check(self, device: int, rate_hz: int) -> None:
        if rate_hz not in self.devices[device].get("rates_hz", self.rates_hz):
            raise self.PortAudioError("Invalid sample rate [PaErrorCode -9997]")

    def InputStream(self, **options: Any) -> FakeInput:
        self._may_open(options)
        self.inputs.append(FakeInput(self, options))
        return self.inputs[-1]

    def OutputStream(self, **options: Any) -> FakeOutput:
        self._may_open(options)
        self.outputs.append(FakeOutput(self, options))
        return self.outputs[-1]

    def _may_open(self, options: dict[str, Any]) -> None:
        if self.hangs is not None:
            assert self.hangs.wait(60.0), "the test forgot its robot"
        self._check(options["device"], options["samplerate"])
        if self.busy:
            raise self.PortAudioError("Device unavailable [PaErrorCode -9985]")

    def interrupt(self, heard: Samples, status: Status | None = None, skew: int = 0) -> Samples:
        """The microphone has taken `heard`, shape (n,) or (n, channels); waits for what is written to be played then.

        Returns what was written, its first channel.
        """
        microphone, loudspeaker = self.inputs[-1], self.outputs[-1]
        with self.change:
            assert microphone.active
            before = len(loudspeaker.played)
            frames = heard.reshape(len(heard), -1)
            played = round(len(heard) * loudspeaker.options["samplerate"] / microphone.options["samplerate"])
            loudspeaker.play(played + skew)
            microphone.coming.append((frames, status or Status()))
            loudspeaker.status = status or Status()
            self.change.notify_all()
            assert self.change.wait_for(
                lambda: (
                    (microphone.waiting and not microphone.coming)
                    or loudspeaker.waiting
                    or microphone.gone
                    or microphone.closed
                ),
                20.0,
            ), "nobody listens"
            new = loudspeaker.played[before:]
        return np.concatenate(new) if new else np.zeros(0, np.float32)

    def die(self) -> None:
        """The devices are pulled out, or the sound server is killed."""
        with self.change:
            for stream in (*self.inputs[-1:], *self.outputs[-1:]):
                stream.gone = True
            self.change.notify_all()


class FakeStream:
    """What both directions have in common."""

    def __init__(self, card: FakeCard, options: dict[str, Any]) -> None:
        self.card = card
        self.options = options
        self.latency = 0.02
        self.active = self.stopped = self.closed = self.gone = False

    def start(self) -> None:
        if self.gone or self.card.refuses_to_start:
            raise self.card.PortAudioError("Device unavailable")
        self.active = True

    def stop(self, ignore_errors: bool = True) -> None:
        self.stopped = True
        self.active = False

    def abort(self, ignore_errors: bool = True) -> None:
        with self.card.change:
            self.gone = True
            self.card.change.notify_all()

    def close(self, ignore_errors: bool = True) -> None:
        with self.card.change:
            self.closed = True
            self.active = False
            self.card.change.notify_all()


class FakeInput(FakeStream):
    """A microphone that waits for `FakeCard.interrupt`."""

    def __init__(self, card: FakeCard, options: dict[str, Any]) -> None:
        super().__init__(card, options)
        self.coming: deque[tuple[Samples, Status]] = deque()
        self.waiting = False
        self._rest = np.zeros((0, options["channels"]), np.float32)

    @property
    def read_available(self) -> int:
        with self.card.change:
            return len(self._rest) + sum(len(heard) for heard, _ in self.coming)

    def read(self, frames: int) -> tuple[Samples, bool]:
        overflowed = False
        with self.card.change:
            while len(self._rest) < frames:
                self.waiting = True
                self.card.change.notify_all()
                assert self.card.change.wait_for(lambda: self.coming or self.gone, 60.0), "the test forgot its robot"
                self.waiting = False
                if not self.coming:
                    raise self.card.PortAudioError("Unanticipated host error [PaErrorCode -9999]")
                heard, status = self.coming.popleft()
                assert heard.shape[1] == self.options["channels"]
                overflowed |= status.input_overflow
                self._rest = np.concatenate([self._rest, heard])
            taken, self._rest = self._rest[:frames], self._rest[frames:]
        return taken.copy(), overflowed


class FakeOutput(FakeStream):
    """A loudspeaker with a buffer; what is written waits in it until `play` has made room."""

    def __init__(self, card: FakeCard, options: dict[str, Any]) -> None:
        super().__init__(card, options)
        self.played: list[Samples] = []
        self.frames: list[Samples] = []
        self.status = Status()
        block = options.get("blocksize", 400)
        asked = round(options["latency"] * options["samplerate"]) if "latency" in options else 3 * block
        self.buffer = card.buffer_frames or asked + block  # PortAudio gives a block more than it is asked for
        self.level = 0
        self.ran_dry = 0
        self._wants = 0

    @property
    def write_available(self) -> int:
        return self.buffer - self.level

    @property
    def waiting(self) -> bool:
        """Whether `write` waits for room."""
        return self._wants > self.write_available

    def play(self, frames: int) -> None:
        self.ran_dry += max(0, frames - self.level)
        self.level = max(0, self.level - frames)

    def write(self, samples: Any) -> bool:
        if self.gone:
            raise self.card.PortAudioError("Stream is stopped")
        assert samples.dtype == np.float32
        assert samples.shape[1] == self.options["channels"]
        with self.card.change:
            self._wants = len(samples)
            self.card.change.notify_all()
            assert self.card.change.wait_for(lambda: not self.waiting or self.gone, 20.0), "nothing is played"
            self._wants = 0
            self.level += len(samples)
        self.frames.append(samples)
        self.played.append(samples[:, 0])
        return self.status.output_underflow
