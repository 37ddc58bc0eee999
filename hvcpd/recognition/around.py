"""Ears around other ears: what a stage does not change passes through it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Self

from hvcpd.recognition.events import Ears
from hvcpd.recognition.stream import Chunk


class EarsAround:
    """The properties of the `Ears` inside, as they are."""

    def __init__(self, ears: Ears) -> None:
        self._ears = ears

    @property
    def busy(self) -> bool:
        """Whether somebody else is speaking, or has spoken and may still be understood."""
        return self._ears.busy

    @property
    def speaking(self) -> bool:
        """As `Ears.speaking`."""
        return self._ears.speaking

    @property
    def signs(self) -> bool:
        """As `Ears.signs`."""
        return self._ears.signs

    @property
    def chunks(self) -> Sequence[Chunk]:
        """As `Ears.chunks`."""
        return self._ears.chunks

    @property
    def ends(self) -> bool:
        """As `Ears.ends`."""
        return self._ears.ends

    @property
    def since(self) -> int | None:
        """As `Ears.since`."""
        return self._ears.since

    def adopt(self, others: Self) -> None:
        """As `Ears.adopt`."""
        self._ears.adopt(others._ears)

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations while `go_on` holds, in any thread."""
        self._ears.prepare(go_on)
