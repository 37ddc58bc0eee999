"""Words whose samples are known."""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.ports import Samples


@dataclass(frozen=True, eq=False)
class Way:
    """One way to say a word, at hand."""

    samples: Samples
    final: bool = True
    lead: int = 0
    advance: int = 0

    @property
    def length(self) -> int:
        return len(self.samples)
