"""The daemon's microphone and loudspeaker, which outlive the sound card: what fails is opened again, time goes on.

While there is no sound, `read` gives blocks without samples that tell how much time has passed, so that the sample
clock, the wheels, the memory and whoever asks from outside are served on. So it does while the microphone does not hear
even what the loudspeaker plays: a robot that cannot hear "stop" stands still.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import asdict, dataclass, fields

import numpy as np
import structlog

from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_exchange import SoundStream, StreamCounters
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in

RAISED_BY = 5
RAISED_WITHIN_S = 10
"""Number of seconds with a disturbed block, within RAISED_WITHIN_S, that raise the alarm: one stall, however long, is
one or two. At a load of 5 to 13 two robots had one such second in ten (docs/daemon.md), and understood each other."""
CLEARED_BY = 2
CLEARED_WITHIN_S = 30
"""Most seconds with a disturbed block, within CLEARED_WITHIN_S, that end the alarm: hardly one in three of the longest
sentences."""

TOO_BUSY = "the computer is too busy"

_log = structlog.get_logger(__name__)


class Overload:
    """Detects that the computer is too busy: `note` each block; `standing` is the alarm. Times are seconds of sound."""

    def __init__(self) -> None:
        self._disturbed_s: deque[int] = deque()
        self._since_s: float | None = None
        self._blocks = 0

    @property
    def standing(self) -> bool:
        """Whether sound is lost or late so often that recognition is unreliable."""
        return self._since_s is not None

    def note(self, now_s: float, disturbed: bool) -> None:
        """Note a block at `now_s`, and whether sound was lost or late since the one before."""
        if disturbed:
            self._blocks += 1
            if not self._disturbed_s or self._disturbed_s[-1] < int(now_s):
                self._disturbed_s.append(int(now_s))
        while self._disturbed_s and now_s - self._disturbed_s[0] > CLEARED_WITHIN_S:
            self._disturbed_s.popleft()
        if self._since_s is None:
            self._raise(now_s)
        elif now_s - self._since_s >= CLEARED_WITHIN_S and len(self._disturbed_s) <= CLEARED_BY:
            _log.info("the computer keeps up again", after_s=round(now_s - self._since_s, 1), disturbed=self._blocks)
            self._since_s = None
        if self._since_s is None and not self._disturbed_s:
            self._blocks = 0

    def _raise(self, now_s: float) -> None:
        recent = sum(now_s - at_s <= RAISED_WITHIN_S for at_s in self._disturbed_s)
        if recent < RAISED_BY:
            return
        self._since_s = now_s
        _log.warning(
            TOO_BUSY,
            disturbed=self._blocks,
            remedy="sound is lost or late; end other programs, or give the robot a faster computer",
        )


def is_disturbed(before: StreamCounters, after: StreamCounters) -> bool:
    """Whether sound was lost or late between two counts. Silence inserted between two clocks counts as neither."""
    if before is after:
        return False
    lost = ("input_dropped", "output_dropped", "output_late", "card_overflows", "card_underflows", "card_lost")
    return any(getattr(after, name) > getattr(before, name) for name in lost)


LOSSES_EVERY_S = 60.0
"""Shortest interval of reports on lost sound."""
GAP_S = 0.1
"""Without sound time is told in such steps: half of what a wheel that stands is spoken to by, and far more often than a
systemd watchdog needs to be fed."""
RETRY_FIRST_S = 0.5
RETRY_MOST_S = 10.0
"""Pauses between attempts, each twice as long as the one before: a sound server is back within a second, a plug that
somebody has to find is not, and an attempt costs about 0.1 s of processor time."""
STEADY_S = 10.0
"""Life of a stream after which its next failure is met with the short pause again: it has shown that it works."""
MUTE_S = 10.0
"""Length of digital zeros after which the microphone counts as one that may not hear."""
UNHEARD_S = 2.0
"""Length of the robot's own voice that such a microphone must have missed, too: one that only leaves out a quiet room's
noise hears that. Sound comes back no later (`audio.queue_s`)."""
STANDS = "the robot stands still until it hears again"
LET_GO_S = 30.0
"""Time after which a card that is not let go counts as held by a library that hangs; then only a new process helps."""

_NONE = np.zeros(0, np.float32)


@dataclass(frozen=True)
class Block:
    """The sound heard: shape (n,), n = 0 without sound; `lost` samples before it are missing (`Robot.step`).

    `disturbed`: sound was lost or late since the block before, at the microphone or at the loudspeaker.
    """

    samples: Samples
    lost: int | None
    disturbed: bool = False


class SoundService:
    """Call `open`, `start`, then `read` and `write` in turn, then `close`. Only the first opening raises DeviceError.

    `clock` (monotonic, s) and `sleep` are the event loop's; a test hands in others.
    """

    def __init__(
        self,
        make_stream: Callable[[], SoundStream],
        clock: Callable[[], float] | None = None,
        sleep: Callable[[float], Awaitable[None]] = asyncio.sleep,
        let_go_s: float = LET_GO_S,
    ) -> None:
        self._make_stream = make_stream
        self._clock = clock or asyncio.get_running_loop().time
        self._sleep = sleep
        self._let_go_s = let_go_s
        self._stream = make_stream()
        self._before = self._counted = StreamCounters()
        self._seen: StreamCounters | None = None
        self._all = self._reported = StreamCounters()
        self._quiet_s = self._unheard_s = 0.0
        self._silence = _NONE
        self.mute = False
        """The microphone has given nothing but zeros for MUTE_S."""
        self.deaf = False
        """Nor has it heard UNHEARD_S of what was played meanwhile."""
        self.overload = Overload()
        self._sampled_s = 0.0
        self._reported_s = self._heard_s = self._since_s = self._failed_s = 0.0
        self._pause_s = RETRY_FIRST_S
        self._recovery: asyncio.Task[Samples] | None = None

    async def open(self) -> None:
        """Open the card, still silent. Raises DeviceError: a person who starts a robot must see what is missing."""
        await self._stream.open()

    async def start(self) -> None:
        """Start recording and playing. Raises DeviceError."""
        await self._stream.start()
        self._heard_s = self._since_s = self._reported_s = self._clock()

    @property
    def latency_s(self) -> float:
        """As `AudioStream.latency_s`, of the stream that is open or was the last."""
        return self._stream.latency_s

    @property
    def flowing(self) -> bool:
        """Whether the stream is open."""
        return self._recovery is None

    @property
    def counters(self) -> StreamCounters:
        """The sound lost since the start, over all streams; the same object until more is lost."""
        now = self._stream.counters
        if now is not self._seen:
            self._seen = now
            self._all = _sum(self._before, now)
        return self._all

    async def read(self) -> Block:
        """The next block heard or, after GAP_S without sound, an empty one that only says how much time has passed.

        Raises DeviceError if the failed card cannot be let go of.
        """
        if self._recovery is not None:
            return await self._wait(self._recovery)
        try:
            samples = await self._stream.read()
        except DeviceError as error:
            self._fail(str(error))
            return Block(_NONE, self._passed(0))
        self._heard_s = self._clock()
        before, self._counted = self._counted, self.counters
        self._sampled_s += samples.size / SAMPLE_RATE_HZ
        disturbed = is_disturbed(before, self._counted)
        self.overload.note(self._sampled_s, disturbed)
        if self._heard_s - self._reported_s >= LOSSES_EVERY_S and not self.overload.standing:  # one alarm says it
            self.tell_losses()
        self._notice_zeros(samples)
        lost = self._counted.input_dropped + self._counted.card_lost - before.input_dropped - before.card_lost
        if self.deaf:
            return Block(_NONE, samples.size + lost)
        gap = lost > 0 or self._counted.card_overflows > before.card_overflows
        return Block(samples, lost if gap else None, disturbed)

    def write(self, samples: Samples) -> None:
        """Play sound, shape (n,), float32, as long as the block that was read; without a card it is dropped."""
        if self._recovery is None:
            self._unheard_s += samples.size / SAMPLE_RATE_HZ * bool(samples.any())
            self._stream.write(self._silence if self.deaf else samples)

    async def close(self) -> None:
        """Close the card. Never raises for a device."""
        if self._recovery is not None:
            self._recovery.cancel()
            await asyncio.wait([self._recovery])
        try:
            await self._let_go()
        except DeviceError as error:
            _log.error("sound card not closed", reason=str(error))

    def tell_losses(self) -> None:
        """Log a line if sound was lost since the last one."""
        self._reported_s = self._clock()
        counters = self.counters
        if counters != self._reported:
            self._reported = counters
            _log.warning("sound lost", **{name: count for name, count in asdict(counters).items() if count})

    def _notice_zeros(self, samples: Samples) -> None:
        """Even the quietest room makes some noise in a microphone; a switch or a wrong channel gives none."""
        if samples.any():
            if self.mute:
                _log.info("the microphone gives sound")
            self._quiet_s, self._unheard_s, self.mute, self.deaf = 0.0, 0.0, False, False
            return
        self._quiet_s += samples.size / SAMPLE_RATE_HZ
        if self._quiet_s >= MUTE_S and not self.mute:
            self.mute = True
            _log.warning(
                "the microphone is mute",
                zeros_s=MUTE_S,
                remedy="is it switched off, turned down in `alsamixer`, or not the one named by audio.input_device or "
                "audio.input_channel?",
            )
        if self.mute and self._unheard_s >= UNHEARD_S and not self.deaf:
            self.deaf, self._silence = True, np.zeros_like(samples)
            _log.error("the robot is deaf", reason="it does not hear its own voice", remedy=STANDS)

    def _passed(self, n: int) -> int:
        """Samples between what was accounted for and the `n` that have come now; from here on all is accounted for."""
        now_s = self._clock()
        lost = max(samples_in(now_s - self._heard_s) - n, 0)
        self._heard_s = now_s
        return lost

    def _fail(self, reason: str) -> None:
        now_s = self._failed_s = self._clock()
        if now_s - self._since_s >= STEADY_S:
            self._pause_s = RETRY_FIRST_S
        _log.error("sound failed", reason=reason, remedy=STANDS)
        self._recovery = asyncio.ensure_future(self._recover())

    async def _wait(self, recovery: asyncio.Task[Samples]) -> Block:
        ticker = asyncio.ensure_future(self._sleep(GAP_S))
        try:
            await asyncio.wait((ticker, recovery), return_when=asyncio.FIRST_COMPLETED)
        finally:
            ticker.cancel()
        if not recovery.done():
            return Block(_NONE, self._passed(0))
        samples = recovery.result()
        self._recovery = None
        self._counted = self.counters  # by the clock, what this stream lost so far is accounted for
        self._since_s = self._clock()
        _log.info("sound is back", after_s=round(self._since_s - self._failed_s, 1), latency_s=round(self.latency_s, 3))
        return Block(samples, self._passed(samples.size))

    async def _recover(self) -> Samples:
        """Let go of the card, open it again as often as it takes; returns the first that is heard."""
        while True:
            await self._let_go()
            await self._sleep(self._pause_s)
            self._pause_s = min(2 * self._pause_s, RETRY_MOST_S)
            self._before = self._counted = self.counters
            self._seen = None
            self._stream = self._make_stream()
            try:
                await self._stream.open(afresh=True)
                await self._stream.start()
                return await self._stream.read()
            except DeviceError as error:
                _log.warning("still no sound", reason=str(error), next_try_s=self._pause_s)

    async def _let_go(self) -> None:
        try:
            await asyncio.wait_for(self._stream.close(), self._let_go_s)
        except TimeoutError as error:
            raise DeviceError(
                f"the sound card was not released for {self._let_go_s:g} s; does the sound server hang? Restart it"
            ) from error


def _sum(one: StreamCounters, other: StreamCounters) -> StreamCounters:
    return StreamCounters(*(getattr(one, part.name) + getattr(other, part.name) for part in fields(StreamCounters)))
