"""People's one-time codes, of the sheet and of the clock: each is accepted once, and none before the last one."""

from __future__ import annotations

from collections.abc import Mapping

from hvcpd.security.keys import TeamKey
from hvcpd.security.one_time import counted_code, step_of

SHEET_WINDOW = 10
"""Number of the sheet's codes after the last one heard that are accepted: others may have been crossed out, or said to
others."""
CLOCK_DRIFT = 1
"""A robot's clock may be one step off, either way (RFC 6238, section 5.2)."""


LOST = "lost/"
"""Marks a key without a counter: nobody knows which codes of its sheet were used. None of them is accepted."""


class Codes:
    """The codes of one team key. `wall_s`: seconds since 1970 when the sample clock was 0, None without a clock.

    `counters`: the last code accepted of each kind, from a former life; the property `counters` is the part to
    remember.
    """

    def __init__(self, key: TeamKey, counters: Mapping[str, int], wall_s: float | None) -> None:
        self._key = key
        self.wall_s = wall_s
        self._names = {kind: f"{kind}/{key.fingerprint}" for kind in ("sheet", "clock")}
        self.counters = {name: counters[name] for name in self._names.values() if name in counters}
        self._is_sheet_lost = f"{LOST}{key.fingerprint}" in counters

    def take(self, digits: str, now: float) -> bool:
        """Whether the code is valid now; if so, it is used up."""
        last = self.counters.get(self._names["sheet"], -1)
        if not self._is_sheet_lost and self._take(
            "sheet", self._key.sheet_key, digits, range(last + 1, last + 1 + SHEET_WINDOW)
        ):
            return True
        if self.wall_s is None:
            return False
        step = step_of(self.wall_s + now)
        last = self.counters.get(self._names["clock"], -1)
        first = max(step - CLOCK_DRIFT, last + 1)
        return self._take("clock", self._key.clock_key, digits, range(first, step + CLOCK_DRIFT + 1))

    def _take(self, kind: str, key: bytes, digits: str, counts: range) -> bool:
        found = next((count for count in counts if counted_code(key, count) == digits), None)
        if found is None:
            return False
        self.counters[self._names[kind]] = found
        return True
