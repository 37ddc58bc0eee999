"""One full-duplex stream of sound between a sound card and the event loop.

PortAudio calls back on a thread of its own. That thread touches nothing but two bounded queues under a lock, and
wakes the event loop at most once for all blocks that wait; so neither side can hold up the other, and what is lost
when one is late is counted.

The two directions stay aligned: what is written after the block that began at microphone sample n is played a fixed
time after it was recorded. So sound that comes too late is left out, not played later, and the robot knows when it
hears itself.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from hvcpd.config.settings import AudioSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio import SoundDevice, find_device, list_afresh, load_backend
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

LEAD_BLOCKS = 2
"""Blocks of silence that are played before the first that is written: so late may the robot be without a gap. One is
the block that it is thinking about, one is for the delays of a busy processor."""


@dataclass(frozen=True)
class StreamCounters:
    """What was lost since the stream was opened, in samples, and the interrupts in which the card lost sound itself."""

    input_dropped: int = 0
    output_dropped: int = 0
    output_late: int = 0
    card_overflows: int = 0
    card_underflows: int = 0


class SampleQueue:
    """Blocks of sound that wait, no more than `capacity` samples of them; not locked."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._blocks: deque[Samples] = deque()
        self._length = 0

    def __len__(self) -> int:
        return self._length

    def put(self, block: Samples) -> int:
        """Append a block of shape (n,) and drop the oldest samples that do not fit; returns how many those are."""
        self._blocks.append(block)
        self._length += block.size
        excess = max(0, self._length - self._capacity)
        self.take(excess)
        return excess

    def take(self, count: int) -> Samples:
        """The oldest `count` samples, or all if there are fewer."""
        taken: list[Samples] = []
        missing = count
        while missing > 0 and self._blocks:
            block = self._blocks.popleft()
            if block.size > missing:
                self._blocks.appendleft(block[missing:])
                block = block[:missing]
            taken.append(block)
            missing -= block.size
        self._length -= count - missing
        return np.concatenate(taken) if taken else np.zeros(0, np.float32)


class AudioStream:
    """Microphone and loudspeaker at 16 kHz, mono, in blocks of `settings.block_ms`.

    Use: `await open()`, `await start()`, then `await read()` and `write(samples)` in turn, at last `await close()`.
    The microphone's samples are the robot's clock; every one is delivered in order or counted in
    `counters.input_dropped`. `write` gives as many samples as were read.
    """

    def __init__(self, settings: AudioSettings, backend: Any | None = None) -> None:
        self._settings = settings
        self._backend = backend
        self._block = SAMPLE_RATE_HZ * settings.block_ms // 1000
        capacity = max((LEAD_BLOCKS + 2) * self._block, round(settings.queue_s * SAMPLE_RATE_HZ))
        self._lock = threading.Lock()
        self._heard = SampleQueue(capacity)
        self._to_say = SampleQueue(capacity)
        self._to_say.put(np.zeros(LEAD_BLOCKS * self._block, np.float32))
        self._late = 0
        self._counters: dict[str, int] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ready = asyncio.Event()
        self._wake_pending = False
        self._ended = False
        self._stream: Any = None
        self._name = ""
        self._card_s = 0.0

    async def open(self, afresh: bool = False) -> None:
        """Find and open the devices, still silent. Raises DeviceError if there is none, or none with 16 kHz.

        `afresh`, PortAudio lists the devices anew; no other stream may be open then.
        """
        self._loop = asyncio.get_running_loop()
        self._stream = await asyncio.to_thread(self._open, afresh)
        self._card_s = sum(float(part) for part in self._stream.latency)

    async def start(self) -> None:
        """Begin to hear and to play. Raises DeviceError."""
        await asyncio.to_thread(self._start)

    @property
    def latency_s(self) -> float:
        """From the end of a block that was read until what is then written is heard in the microphone, s.

        The lead and what the card tells of its own buffers; known once the stream is open.
        """
        return LEAD_BLOCKS * self._block / SAMPLE_RATE_HZ + self._card_s

    async def read(self) -> Samples:
        """The next block heard, shape (n,), float32. Raises DeviceError if none comes for `settings.watchdog_s`."""
        while True:
            with self._lock:
                block = self._heard.take(self._block)
                ended = self._ended
                if block.size == 0:
                    self._ready.clear()
                    self._wake_pending = False
            if block.size > 0:
                return block
            if ended:
                raise DeviceError(f"the sound card {self._name!r} stopped; is it still connected?")
            try:
                await asyncio.wait_for(self._ready.wait(), self._settings.watchdog_s)
            except TimeoutError as error:
                raise DeviceError(
                    f"no sound came from {self._name!r} for {self._settings.watchdog_s:g} s; is it still connected, "
                    "and does the sound server run?"
                ) from error

    def write(self, samples: Samples) -> None:
        """Have sound of shape (n,) played after what waits already.

        What should have been played by now is left out and counted as late, what does not fit as dropped.
        """
        with self._lock:
            late = min(self._late, samples.size)
            self._late -= late
            self._count("output_late", late)
            self._count("output_dropped", self._to_say.put(np.asarray(samples[late:], np.float32)))

    @property
    def counters(self) -> StreamCounters:
        """What was lost so far."""
        with self._lock:
            return StreamCounters(**self._counters)

    async def close(self) -> None:
        """Stop and let go of the devices; what waits is not played. Never raises for a device that is gone."""
        stream, self._stream = self._stream, None
        if stream is not None:
            await asyncio.to_thread(stream.close, True)

    def _open(self, afresh: bool) -> Any:
        backend = self._backend if self._backend is not None else load_backend()
        if afresh:
            list_afresh(backend)
        microphone = find_device(backend, "input", self._settings.input_device)
        loudspeaker = find_device(backend, "output", self._settings.output_device)
        self._name = microphone.name
        self._check_rate(backend, microphone, backend.check_input_settings)
        self._check_rate(backend, loudspeaker, backend.check_output_settings)
        try:
            return backend.Stream(
                samplerate=SAMPLE_RATE_HZ,
                blocksize=self._block,
                device=(microphone.index, loudspeaker.index),
                channels=1,
                dtype="float32",
                callback=self._exchange,
                finished_callback=self._finished,
            )
        except (backend.PortAudioError, ValueError) as error:
            raise DeviceError(
                f"{microphone.name!r} and {loudspeaker.name!r} cannot be opened together ({error}); "
                "is another program using them?"
            ) from error

    def _start(self) -> None:
        backend = self._backend if self._backend is not None else load_backend()
        try:
            self._stream.start()
        except backend.PortAudioError as error:
            raise DeviceError(f"{self._name!r} does not start ({error}); is another program using it?") from error

    def _check_rate(self, backend: Any, device: SoundDevice, check: Any) -> None:
        try:
            check(device=device.index, channels=1, dtype="float32", samplerate=SAMPLE_RATE_HZ)
        except (backend.PortAudioError, ValueError) as error:
            raise DeviceError(
                f"{device.name!r} cannot do {SAMPLE_RATE_HZ} Hz mono ({error}); its own rate is {device.rate_hz:g} Hz; "
                "choose a device that converts, such as 'default', 'plug' or 'pulse'"
            ) from error

    def _exchange(self, heard: Any, to_say: Any, frames: int, _time: Any, status: Any) -> None:
        """PortAudio's callback, on its thread: arrays of shape (frames, 1), float32."""
        block = np.array(heard[:, 0], np.float32)
        with self._lock:
            lost = self._heard.put(block)
            self._count("input_dropped", lost)
            out = self._to_say.take(frames)
            to_say[: out.size, 0] = out
            to_say[out.size :, 0] = 0.0
            # Nothing will ever be written for samples that the robot cannot read.
            self._late = max(0, self._late + frames - out.size - lost)
            if status:
                self._count("card_overflows", int(bool(status.input_overflow)))
                self._count("card_underflows", int(bool(status.output_underflow)))
            wake, self._wake_pending = not self._wake_pending, True
        if wake:
            self._wake()

    def _finished(self) -> None:
        with self._lock:
            self._ended = True
        self._wake()

    def _wake(self) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._ready.set)

    def _count(self, name: str, by: int) -> None:
        self._counters[name] = self._counters.get(name, 0) + by
