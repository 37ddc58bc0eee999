"""Words whose samples are known."""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.ports import Samples
from hvcpd.recognition.channel.estimation import Taps, channel_responses


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


def response(autocorrelation: Taps, correlation: Taps, n: int) -> Taps:
    """`channel_responses` of one signal, shape (n,)."""
    taps: Taps = channel_responses(autocorrelation[None], correlation[None], n)[0]
    return taps
