"""Listens to a stretch of sound for sentences of robots whose channels are not known.

One after the other is found and taken out of the sound, and what is left is listened to again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hvcpd.language.graph import WordGraph, graph_of
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.response import Taps
from hvcpd.recognition.channel.search import ChannelSearch, Path
from hvcpd.recognition.channel.weighting import FRAME, WeightedSound
from hvcpd.recognition.events import Recognised, Source, WordSpan
from hvcpd.recognition.paths import Voicebook

NOISE_S = 0.5
"""A quiet stretch of that length is what the noise is known by..."""
QUIETER = 0.2
"""...than which so many are quieter: gain controls and drop-outs make some that tell nothing."""
LEAST_SCORE = 450.0
"""Explained energy, in variances of the noise: chance and other talk reach 390."""
LEAST_LEAD, LEAST_LEAD_SHARE = 40.0, 0.03
"""What a sentence must explain more than any other one, and than any beginning of a longer one."""
LEAST_FIT = 0.4
"""Of what was to be expected of each word through the response, so much must have been heard."""
SHORT, SHORT_REST = 3, 5 * SAMPLE_RATE_HZ // 4
"""A sentence of so few words is told only near the end of a stretch, within so many samples (1.25 s): amid other talk
it may be a part of it."""
MOST_AT_ONCE = 2
"""Robots that speak at the same time."""
SURE = 0.99
"""Confidence of what is told."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Sound, shape (n,), from sample `origin` on; `lead` samples of it are from before the speech, which was noticed at
    the samples `noticed` of the sound. `proposed`: sentences that others made of it."""

    sound: Samples
    origin: int
    lead: int
    noticed: tuple[int, ...]
    proposed: tuple[Recognised, ...] = ()


@dataclass(frozen=True)
class Look:
    """The sentences in a stretch; whether a robot said something else there; whether it seemed to go on; and the
    responses that voices came through, shape (TAPS,) each."""

    sentences: tuple[Recognised, ...] = ()
    robot: bool = False
    unfinished: bool = False
    channels: tuple[tuple[str, Taps], ...] = field(default=(), compare=False)


class ChannelListener:
    """Knows the voices of robots."""

    def __init__(self, graph: WordGraph, books: Sequence[Voicebook]) -> None:
        self._search = ChannelSearch(graph, books)
        self._books = books
        self._final = next(iter(graph.finals))

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make ready what takes long the first time, as long as `go_on`."""
        for book in self._books:
            book.prepare(go_on)

    def look(self, stretch: Stretch) -> Look:
        """What robots said in it."""
        begin = max(stretch.lead - round(0.5 * SAMPLE_RATE_HZ), 0)
        heard = stretch.sound[begin:].copy()
        if len(heard) < FRAME:
            return Look()
        noise = quiet_part(stretch.sound[: stretch.lead], heard)
        noticed = [at - begin for at in stretch.noticed]
        told: list[Recognised] = []
        channels: list[tuple[str, Taps]] = []
        for _ in range(MOST_AT_ONCE):
            sound = WeightedSound(heard, noise)
            paths = self._search.paths(sound, noticed)
            for sentence in stretch.proposed:
                paths += self._proposed(sound, sentence, sentence.start_sample - stretch.origin - begin)
            paths.sort(key=lambda path: -path.score)
            if not paths or paths[0].score < LEAST_SCORE:
                break
            best = self._sure(sound, paths)
            if best is None:
                reaches_end = paths[0].end + SAMPLE_RATE_HZ > len(heard)
                return Look(tuple(told), True, reaches_end, tuple(channels))
            sentence = _told(best, stretch.origin + begin, heard, noise)
            if not any(_is_left_of(sentence, each) for each in told):
                told.append(sentence)
                channels.append((best.book.voice, best.response))
            heard -= best.sound(len(heard))
        return Look(tuple(told), channels=tuple(channels))

    def _proposed(self, sound: WeightedSound, sentence: Recognised, at: int) -> list[Path]:
        """The paths of a sentence that begins about sample `at`."""
        books = [book for book in self._books if book.voice == sentence.voice]
        alone = ChannelSearch(graph_of(sentence.words, frozenset(range(len(sentence.words)))), books)
        found = [path for path in alone.paths(sound, [at]) if alone.is_whole(path)]
        return [replace(path, node=self._final) for path in found]

    def _sure(self, sound: WeightedSound, paths: Sequence[Path]) -> Path | None:
        """The sentence that explains most, unless another one explains nearly as much, a longer one more, or a word of
        it hardly fits."""
        best = next((path for path in paths if self._search.is_whole(path)), None)
        if best is None or best.score < LEAST_SCORE:
            return None
        rivals = (path.score for path in paths if path.words != best.words[: len(path.words)])
        lead = best.score - max(rivals, default=0.0)
        if len(best.words) <= SHORT and sound.n - best.end > SHORT_REST:
            return None
        surely = lead >= max(LEAST_LEAD, LEAST_LEAD_SHARE * best.score)
        return best if surely and self._search.least_fit(sound, best) >= LEAST_FIT else None


def quiet_part(before: Samples, heard: Samples) -> Samples:
    """A quiet NOISE_S of what was heard before; of all that was heard, if that was shorter."""
    n = round(NOISE_S * SAMPLE_RATE_HZ)
    where = before if len(before) >= 2 * n else heard
    n = max(min(n, len(where) // 4), FRAME)
    energy = np.concatenate([[0.0], np.cumsum(np.square(where, dtype=np.float64))])
    starts = np.arange(0, max(len(where) - n, 0) + 1, FRAME // 2)
    order = np.argsort(energy[np.minimum(starts + n, len(where))] - energy[starts])
    at = int(starts[order[int(QUIETER * (len(order) - 1))]])
    return where[at : at + n]


def _is_left_of(sentence: Recognised, told: Recognised) -> bool:
    """Whether it is made of what no short response explains of one that is told, its late echoes: a robot does not say
    two things at once."""
    overlap = sentence.start_sample < told.end_sample and told.start_sample < sentence.end_sample
    return overlap and sentence.voice == told.voice


def _told(path: Path, origin: int, heard: Samples, noise: Samples) -> Recognised:
    delay = path.delay + origin
    spans = tuple(
        WordSpan(word, start + delay, start + delay + said.length, SURE)
        for word, start, said in zip(path.words, path.starts, path.said, strict=True)
    )
    power = float(np.mean(np.square(heard[max(path.starts[0], 0) : path.end], dtype=np.float64)))
    ratio = power / max(float(np.mean(np.square(noise, dtype=np.float64))), 1e-12)
    snr_db = 10.0 * float(np.log10(max(ratio - 1.0, 1e-3)))
    start, end = spans[0].start_sample, spans[-1].end_sample
    return Recognised(path.words, path.book.voice, start, end, SURE, snr_db, spans, Source.CHANNEL)
