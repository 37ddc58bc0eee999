"""Growing silence after wrong seals: a speaker that guesses is heard less and less often."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Patience:
    """How much is forgiven; times in s of the sample clock."""

    free: float = 4.0
    """Wrong seals that cost nothing: misheard words are usual in noise."""
    forgive_s: float = 300.0
    """Time after which one wrong seal is forgotten."""
    per_right: float = 0.5
    """Number of wrong seals forgotten for each right one: a well-heard robot is not silenced for a few."""
    first_s: float = 10.0
    """Length of the first silence; each further wrong seal doubles it."""
    longest_s: float = 3600.0
    """Longest silence: in the end an attacker has one guess an hour."""


CODE_PATIENCE = Patience(free=2.0, forgive_s=900.0)
"""For six digits, which are guessed sixteen times as easily."""


@dataclass
class _Record:
    level: float = 0.0
    at_s: float = 0.0
    silent_until_s: float = float("-inf")


@dataclass
class GrowingSilence:
    """Keeps the score of every named speaker, by name in lower case."""

    patience: Patience = field(default_factory=Patience)
    _records: dict[str, _Record] = field(default_factory=dict)

    def is_silent(self, name: str, now: float) -> bool:
        """Whether sentences under that name are ignored now."""
        record = self._records.get(name)
        return record is not None and now < record.silent_until_s

    def wrong(self, name: str, now: float) -> float | None:
        """Note a wrong seal; returns for how long the speaker is now ignored, s, or None."""
        p, record = self.patience, self._records.setdefault(name, _Record(0.0, now))
        self._forgive(record, now)
        record.level += 1.0
        if record.level <= p.free:
            return None
        # wrong seals may go on for weeks, and 2 to the power of 1,024 is no number
        doublings = min(record.level - p.free - 1.0, math.ceil(math.log2(p.longest_s / p.first_s)))
        silence_s = float(min(p.first_s * 2.0**doublings, p.longest_s))
        record.silent_until_s = now + silence_s
        return silence_s

    def right(self, name: str, now: float) -> None:
        """Note a right one."""
        record = self._records.get(name)
        if record is not None:
            self._forgive(record, now)
            record.level = max(record.level - self.patience.per_right, 0.0)
            if record.level == 0.0:
                del self._records[name]

    def _forgive(self, record: _Record, now: float) -> None:
        """Silence itself forgives nothing."""
        since_s = max(record.at_s, min(record.silent_until_s, now))
        record.level = max(record.level - max(now - since_s, 0.0) / self.patience.forgive_s, 0.0)
        record.at_s = now
