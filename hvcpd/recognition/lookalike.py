"""How much of the urgent word a sentence itself would show: its templates are known, so they can be asked."""

from __future__ import annotations

import numpy as np

from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.frontend import Energies
from hvcpd.recognition.templates import TemplateBank
from hvcpd.recognition.urgent import UrgentSpotter


class Lookalike:
    """Asks the spotter of the word to listen to the words of a sentence in the voice that said it."""

    def __init__(self, bank: TemplateBank, spotter: UrgentSpotter) -> None:
        self._bank = bank
        self._spotter = spotter
        self._takes: dict[tuple[str, str], list[slice]] = {}
        for t in bank.templates:
            self._takes.setdefault((t.voice, t.word), []).append(slice(t.first, t.first + t.length))

    def share(self, sentence: Recognised, start: int, end: int) -> float:
        """The share, from 0 to 1, that the words heard between samples `start` and `end` show by themselves."""
        there = [k for k, s in enumerate(sentence.spans) if s.start_sample < end and start < s.end_sample]
        if not there:
            return 0.0
        spans = sentence.spans[max(there[0] - 1, 0) : there[-1] + 1]
        return max(self._spotter.share_in(self._rendered(sentence.voice, spans, take)) for take in (0, 1))

    def _rendered(self, voice: str, spans: tuple[WordSpan, ...], take: int) -> Energies:
        """The words one after the other: `take` 0 as amid a phrase, 1 as at its end."""
        rows = [self._takes[voice, span.word] for span in spans]
        parts = [self._bank.energies[takes[min(take, len(takes) - 1)]] for takes in rows]
        return np.concatenate(parts).astype(np.float32)
