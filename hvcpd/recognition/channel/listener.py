"""Looks again at speech for the sentence of a robot whose channel is not known; if no robot spoke, others may look."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.search import ChannelSearch, Path
from hvcpd.recognition.channel.weighting import FRAME, TAPS, WeightedSound
from hvcpd.recognition.events import Recognised, Source, WordSpan
from hvcpd.recognition.paths import Voicebook
from hvcpd.recognition.second_look import AFTER_S, BEFORE_S, LooksAgain, Piece

EARLIER_S, LATER_S = 0.35, 0.25
"""From where speech was noticed, a sentence begins so much earlier or later."""
NOISE_S = 0.75
"""The quietest stretch of that length is what the noise is known by."""
LEAST_SCORE = 450.0
"""Explained energy, in variances of the noise: chance and other talk reach 390."""
LEAST_LEAD, LEAST_LEAD_SHARE = 40.0, 0.01
"""What a sentence must explain more than any other one, and than any beginning of a longer one."""


@dataclass(frozen=True, eq=False)
class Found:
    """The path that explains most, if it is of a robot; and whether it is surely the sentence."""

    path: Path
    sure: bool


class ChannelListener:
    """A `LooksAgain` for the voices of robots; what is no robot's is left to `others`."""

    def __init__(self, graph: WordGraph, books: Sequence[Voicebook], others: LooksAgain | None = None) -> None:
        self._search = ChannelSearch(graph, books)
        self._books = books
        self._others = others

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make ready what takes long the first time, as long as `go_on`."""
        for book in self._books:
            book.prepare(go_on)
        if self._others is not None:
            self._others.prepare(go_on)

    def look(self, piece: Piece) -> Recognised | None:
        """The sentence in a piece; None if there is none, or it is not sure which. Where a robot spoke, nobody else is
        asked."""
        first = max(piece.lead - round(BEFORE_S * SAMPLE_RATE_HZ), 0)
        heard = piece.sound[first : piece.lead + piece.end - piece.start + round(AFTER_S * SAMPLE_RATE_HZ)]
        found = self.find(heard, quietest(piece.sound[: piece.lead], heard), piece.lead - first)
        if found is None:
            return self._others.look(piece) if self._others is not None else None
        return _told(found.path, piece, piece.origin + first) if found.sure else None

    def find(self, heard: Samples, noise: Samples, noticed: int) -> Found | None:
        """What explains most of what was heard, shape (n,), where speech was noticed at a sample."""
        sound = WeightedSound(heard, noise)
        begin, end = noticed - round(EARLIER_S * SAMPLE_RATE_HZ), noticed + round(LATER_S * SAMPLE_RATE_HZ)
        paths = self._search.paths(sound, begin, end)
        if not paths or paths[0].score < LEAST_SCORE:
            return None
        best = next((path for path in paths if self._search.is_whole(path)), None)
        if best is None:
            return Found(paths[0], False)
        rivals = [p.score for p in paths if p.words != best.words[: len(p.words)]]
        lead = best.score - max(rivals, default=0.0)
        return Found(best, lead >= max(LEAST_LEAD, LEAST_LEAD_SHARE * best.score) and best.score >= LEAST_SCORE)


def quietest(before: Samples, heard: Samples) -> Samples:
    """The quietest NOISE_S of what was heard before; of all that was heard, if that was shorter."""
    n = round(NOISE_S * SAMPLE_RATE_HZ)
    where = before if len(before) >= n else heard
    n = max(min(n, len(where) // 4), FRAME)
    energy = np.concatenate([[0.0], np.cumsum(np.square(where, dtype=np.float64))])
    starts = np.arange(0, max(len(where) - n, 0) + 1, FRAME // 2)
    at = int(starts[int((energy[np.minimum(starts + n, len(where))] - energy[starts]).argmin())])
    return where[at : at + n]


def _told(path: Path, piece: Piece, origin: int) -> Recognised:
    delay = int(np.abs(path.with_taps(TAPS)[0]).argmax()) + origin
    spans = tuple(
        WordSpan(word, start + delay, start + delay + said.length, 1.0)
        for word, start, said in zip(path.words, path.starts, path.said, strict=True)
    )
    start, end = spans[0].start_sample, spans[-1].end_sample
    return Recognised(path.words, path.book.voice, start, end, 0.99, piece.snr_db, spans, Source.CHANNEL)
