"""One full-duplex stream of sound between sound cards and the event loop.

A thread of its own waits for the cards. It touches nothing but the exchange (two bounded queues under a lock), and
wakes the event loop at most once for all blocks that wait; so neither side can hold up the other, and what is lost when
one is late is counted.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from hvcpd.config.settings import AudioSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio import list_afresh, load_backend
from hvcpd.hardware.audio_card import Loudspeaker, Microphone
from hvcpd.hardware.audio_exchange import LEAD_BLOCKS, SoundExchange, StreamCounters
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in

END_S = 0.5
"""The thread ends by itself within a block; if it has not by then, it waits for a card that hangs."""
OPEN_S = 20.0
"""Opening takes about 0.1 s, some seconds on a computer with far too much to do; longer, and the sound system hangs."""

FIRST_S = 5.0
"""The first block may take this long, when nothing moves yet: a sound server fills its buffers first. PulseAudio takes
1.9 s for it (measured, the monitor of an idle null sink, whose buffer is 2 s)."""


class AudioStream:
    """Microphone and loudspeaker at 16 kHz, mono, in blocks of `settings.block_ms`.

    Use: `await open()`, `await start()`, then `await read()` and `write(samples)` in turn, at last `await close()`.
    The microphone's samples are the robot's clock; every one is delivered in order or counted in
    `counters.input_dropped`. `write` gives as many samples as were read.
    """

    def __init__(self, settings: AudioSettings, backend: Any | None = None, open_s: float = OPEN_S) -> None:
        self._settings = settings
        self._backend = backend
        self._open_s = open_s
        self._block = SAMPLE_RATE_HZ * settings.block_ms // 1000
        self._exchange = SoundExchange(self._block, samples_in(settings.queue_s))
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ready = asyncio.Event()
        self._wake_pending = threading.Event()
        self._ending = threading.Event()
        self._door = threading.Lock()
        self._thread: threading.Thread | None = None
        self._microphone: Microphone | None = None
        self._loudspeaker: Loudspeaker | None = None
        self._patience_s = max(FIRST_S, settings.watchdog_s)
        self._end: str | None = None
        self._name = ""
        self._card_s = 0.0

    async def open(self, afresh: bool = False) -> None:
        """Find and open the devices, still silent. Raises DeviceError if one is missing, refuses or does not answer.

        `afresh`, PortAudio lists the devices anew; no other stream may be open then.
        """
        self._loop = asyncio.get_running_loop()
        await self._in_time(lambda: self._open(afresh))

    async def start(self) -> None:
        """Begin to hear and to play. Raises DeviceError."""
        await self._in_time(self._start)

    @property
    def latency_s(self) -> float:
        """Time from the end of a block that was read until sound written then is heard in the microphone, s.

        The lead, what the card tells of its buffers and how full they are, and the conversions of rates; known once
        the stream is open, and may change as long as it is.
        """
        microphone, loudspeaker = self._microphone, self._loudspeaker
        if microphone is not None and loudspeaker is not None:
            self._card_s = microphone.latency_s + loudspeaker.latency_s
        return LEAD_BLOCKS * self._block / SAMPLE_RATE_HZ + self._card_s

    async def read(self) -> Samples:
        """The next block heard, shape (n,), float32. Raises DeviceError if none comes for `settings.watchdog_s`, or
        FIRST_S at the beginning."""
        loop = asyncio.get_running_loop()
        waited = False
        while True:
            self._ready.clear()
            self._wake_pending.clear()
            end = self._end
            block = self._exchange.take()
            if block.size > 0:
                self._patience_s = self._settings.watchdog_s
                return block
            if end is not None:
                raise DeviceError(end)
            if waited:
                raise DeviceError(
                    f"no sound came from {self._name!r} for {self._patience_s:g} s; is it still connected, "
                    "and does the sound server run?"
                )
            # Not wait_for, which makes a task each time: at forty blocks a second that is felt.
            watchdog = loop.call_later(self._patience_s, self._ready.set)
            try:
                await self._ready.wait()
            finally:
                watchdog.cancel()
            waited = loop.time() >= watchdog.when()  # but if this loop was held up, sound has come meanwhile

    def write(self, samples: Samples) -> None:
        """Queue sound of shape (n,) for playing, as `SoundExchange.write`."""
        self._exchange.write(samples)

    @property
    def counters(self) -> StreamCounters:
        """The losses so far."""
        return self._exchange.counters

    async def close(self) -> None:
        """Stop and close the devices; queued sound is not played. Never raises for a device that is gone.

        Takes as long as the sound system does: one that hangs holds on to its thread.
        """
        self._ending.set()
        if self._loop is not None:
            await self._through_door(self._close)

    def _open(self, afresh: bool) -> None:
        backend = self._backend = self._backend if self._backend is not None else load_backend()
        if afresh:
            list_afresh(backend)
        self._microphone = Microphone(backend, self._settings)
        self._loudspeaker = Loudspeaker(backend, self._settings, self._exchange.count)
        self._name = self._microphone.opened.device.name
        if self._ending.is_set():  # closed while it was being opened
            self._close()

    def _start(self) -> None:
        if self._microphone is None or self._loudspeaker is None or self._backend is None:
            raise RuntimeError("open first")
        try:
            self._loudspeaker.start()
            self._microphone.stream.start()
        except self._backend.PortAudioError as error:
            raise DeviceError(f"{self._name!r} does not start ({error}); is another program using it?") from error
        self._thread = threading.Thread(
            target=self._live,
            args=(self._microphone, self._loudspeaker, self._backend.PortAudioError),
            name="sound",
            daemon=True,
        )
        self._thread.start()

    def _live(self, microphone: Microphone, loudspeaker: Loudspeaker, fault: type[Exception]) -> None:
        """The cards' thread: what was heard for what is to be said, block by block."""
        end = f"the thread of the sound card {self._name!r} ended"
        try:
            while not self._ending.is_set():
                heard, lost = microphone.read()
                if lost is not None:  # told before the block that comes after it
                    self._exchange.count("card_overflows", 1)
                    self._exchange.count("card_lost", lost)
                to_say = self._exchange.swap(heard)
                self._wake()
                underflowed = loudspeaker.write(to_say, microphone.behind)
                self._exchange.count("card_underflows", int(underflowed))
        except fault as error:
            end = f"the sound card {self._name!r} stopped ({error}); is it still connected, does the sound server run?"
        finally:
            self._end = end
            self._wake_pending.clear()
            self._wake()

    def _close(self) -> None:
        streams = [part.stream for part in (self._microphone, self._loudspeaker) if part is not None]
        self._loudspeaker = self._microphone = None
        if self._thread is not None:
            self._thread.join(END_S)
            if self._thread.is_alive():
                for stream in streams:
                    stream.abort(True)
                self._thread.join()  # PortAudio frees what it may still use
        for stream in streams:
            stream.close(True)

    def _wake(self) -> None:
        if self._wake_pending.is_set() or self._loop is None or self._loop.is_closed():
            return
        self._wake_pending.set()
        self._loop.call_soon_threadsafe(self._ready.set)

    async def _in_time(self, function: Callable[[], None]) -> None:
        try:
            await asyncio.wait_for(self._through_door(function), self._open_s)
        except TimeoutError as error:
            raise DeviceError(
                f"the sound system did not answer for {self._open_s:g} s; does the sound server hang? Restart it"
            ) from error

    async def _through_door(self, function: Callable[[], None]) -> None:
        """Run `function` on a thread, one at a time; one that hangs in a library keeps no process from ending."""
        outcome: Future[None] = Future()

        def run() -> None:
            try:
                with self._door:
                    function()
                outcome.set_result(None)
            except DeviceError as error:
                outcome.set_exception(error)
            finally:
                if not outcome.done():
                    outcome.set_exception(RuntimeError("a fault in the sound card's thread; see the traceback before"))

        threading.Thread(target=run, name="sound-door", daemon=True).start()
        await asyncio.shield(asyncio.wrap_future(outcome))
