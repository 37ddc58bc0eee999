"""What a run of tests says of those that it skipped: how many, and how to get them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

REMEDY = "make parts"
"""A reason that names it is mended by it."""


def summary(reasons: Iterable[str]) -> Iterator[str]:
    """One line for the tests whose parts `make parts` installs, one for all others with their reasons."""
    plain = [reason.removeprefix("Skipped: ") for reason in reasons]
    mended = sum(REMEDY in reason for reason in plain)
    if mended:
        yield f"{_tests(mended)} of real parts skipped; for them: {REMEDY}"
    others = Counter(reason for reason in plain if REMEDY not in reason)
    if others:
        listed = "; ".join(f"{reason} ({count})" for reason, count in others.most_common())
        yield f"{_tests(others.total())} skipped for other reasons: {listed}"


def _tests(count: int) -> str:
    return f"{count} test{'s' * (count != 1)}"
