"""The interface between a robot and any of its recognisers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, Self

from hvcpd.ports import Samples
from hvcpd.recognition.events import Event as HearingEvent


class Ears(Protocol):
    """The recogniser, as the robot needs it."""

    @property
    def busy(self) -> bool: ...

    @property
    def signs(self) -> bool: ...

    def push(self, samples: Samples, masked: bool = False) -> list[HearingEvent]: ...

    def lost(self, n_samples: int) -> list[HearingEvent]: ...

    def succeed(self, predecessor: Self) -> None: ...

    def prepare(self, go_on: Callable[[], bool]) -> None: ...


class Overhears(Protocol):
    """`Overhearing`, as the robot needs it."""

    def begin(self, now: int, latency_s: float) -> None: ...

    def play(self, samples: Samples) -> None: ...

    def hear(self, samples: Samples, speaking: bool) -> Sequence[HearingEvent]: ...

    def lost(self) -> None: ...
