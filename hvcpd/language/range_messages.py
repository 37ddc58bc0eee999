"""Statements by which two robots measure how far they are from each other; `hvcpd.ranging` has the arithmetic."""

from __future__ import annotations

from dataclasses import dataclass

HUNDRED = 100


@dataclass(frozen=True)
class HowFarAway:
    """The speaker asks how far the addressee is; the arrival of this very sentence is measured."""


@dataclass(frozen=True)
class Measuring:
    """The addressee's question arrived; the arrival of this very sentence is measured, too."""


@dataclass(frozen=True)
class Measured:
    """The interval from the question to "I will measure it" at the speaker's microphone: the last four digits of the
    number of samples at 16 kHz, as two pairs."""

    hundreds: int
    rest: int

    @property
    def ticks(self) -> int:
        """0 to 9,999."""
        return HUNDRED * self.hundreds + self.rest


def measured(ticks: int) -> Measured:
    """Raises ValueError unless 0 <= ticks < 10,000."""
    hundreds, rest = divmod(ticks, HUNDRED)
    if not 0 <= hundreds < HUNDRED:
        raise ValueError(f"{ticks} has not four digits")
    return Measured(hundreds, rest)


@dataclass(frozen=True)
class CannotMeasure:
    """The speaker drives, or one of the two sentences was not heard well enough."""


RangeStatement = HowFarAway | Measuring | Measured | CannotMeasure

RANGE_FORMS: tuple[tuple[str, type[RangeStatement], str, dict[str, object]], ...] = (
    ("how far are you", HowFarAway, "How far are you from me? Answer, and stand still.", {}),
    ("i will measure it", Measuring, "I listen to when this sentence comes after yours.", {}),
    ("i measure <hundreds> <rest>", Measured, "Between your sentence and mine, in sixteenths of a millisecond.", {}),
    ("i cannot measure it", CannotMeasure, "I drive, or did not hear it well enough.", {}),
)
"""Their wording after the opening, and their meaning."""
