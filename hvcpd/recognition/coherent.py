"""Recognises sentences by their waveform: each sample of a known voice's words is known in advance.

A second listener beside the template network. Templates compare spectra, which noise masks; this listener correlates
waveforms (`matched_filter`). Each word begins at the sample given by the word before it, within the drift of two sample
clocks. So a sentence is a path through the word network along which every next sound must be found at its place. It
recognises synthesizers' voices only. In rooms it relies on the direct sound. It works down to -15 dB.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from hvcpd.language.graph import WordGraph, ends_of
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.matched_filter import (
    HOP,
    REFRESH_FRAMES,
    WhitenedSound,
)
from hvcpd.recognition.onset_search import First, OnsetSchedule
from hvcpd.recognition.paths import (
    BY_CHANCE,
    DRIFT,
    GREETING,
    Coherent,
    Extension,
    HeardWord,
    Path,
    Voicebook,
    compared,
    energy_of,
    fitting,
    likelihood_of,
    passes,
    thirds_of,
)

BEAM = 24
"""Maximum number of active paths."""
LEAST_RANK = 12.0
"""Log likelihood ratio of a path, less what its words add by chance."""
LEAST_SCORE = 100.0
"""Log likelihood ratio of a sentence against noise; people's talk reaches 52 in 19 minutes, right sentences at -15 dB
130 and more."""
LEAST_ALONE = 150.0
"""Log likelihood ratio of a single word against noise: another one may begin with the same hiss."""
GOES_ON = 2080
"""Samples (0.13 s) of a possible next word after which it is checked whether it begins."""
GOES_ON_LATER = 4800
"""Samples (0.3 s) after which it is checked again, since fewer may not stand out."""
STANDS_OUT = 5.0
"""Expected strength from which a word stands out."""
SETTLED = 300.0
"""Score from which a path surely is a sentence, so no other one begins in it."""
CHANCE = 3.2
"""Strength from which a word may have begun, however faint it is expected to be."""
SURELY = 4.5
"""Strength from which a word surely has begun: if none comes of it, the sentence was lost, as among a room's echoes."""
UNWHITENED = 2 * REFRESH_FRAMES * HOP
"""Samples (0.5 s) in which a sentence may have begun before the spectrum of what is heard is known: at a recording's
first sample, or after a silence of zeros, that takes half of it."""
CALM = 10 * SAMPLE_RATE_HZ
"""Samples (10 s) without speech after which memory is freed."""


class CoherentListener:
    """Push sound into it, chunk by chunk."""

    def __init__(self, graph: WordGraph, books: Sequence[Voicebook], ready: bool = True) -> None:
        """`books`: the voices that may speak. None of them is recognised before `prepare`, unless they are `ready`."""
        self._all = tuple(books)
        self._books = self._all if ready else ()
        self._graph = graph
        self._schedule = OnsetSchedule(self._firsts)
        self._sound = WhitenedSound()
        self._unheard: list[Samples] = []
        """Sound pushed while there were no signs of speech."""
        self._end = 0
        """The number of the sample that comes next."""
        self._active = 0
        self._paths: list[Path] = []

    @property
    def listens(self) -> bool:
        """Whether it knows any voice."""
        return bool(self._books)

    @property
    def voiced(self) -> bool:
        """Whether a known voice's harmonics seem to stand out."""
        return self._sound.whitening.voiced

    @property
    def follows(self) -> Path | None:
        """The best partial sentence of two words or more, if it surely is a sentence."""
        best = max((p for p in self._paths if p.parent), key=lambda p: p.score, default=None)
        return best if best is not None and best.score >= LEAST_SCORE else None

    def push(self, first: int, samples: Samples, speech: bool) -> list[Coherent]:
        """Take the samples from number `first` on, shape (n,); `speech`: somebody seems to be speaking."""
        if not self._books:
            return []
        if first != self._end:
            self._break_off(first)
        self._unheard.append(samples)
        self._end += len(samples)
        if not (speech or self._paths or self._sound.whitening.voiced or self._end >= self._schedule.due):
            return []  # in silence, wait and do all the work at once when the search resumes: it costs less
        self._sound.push(np.concatenate(self._unheard))
        self._unheard = []
        if not self._sound.whitening.ready:
            self._schedule.restart(self._end - UNWHITENED)
            return []
        signs = speech or self._sound.whitening.voiced
        if signs or self._paths:
            self._active = self._end
        self._begin(signs)
        if self._end - self._active > CALM and self._active >= 0:
            self._rest()
        return self._follow()

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare the reference sounds while `go_on` holds, then start to recognise. Any thread may call this."""
        for book in self._all:
            book.prepare(go_on)
            if go_on() and book not in self._books:
                self._books = (*self._books, book)
                self._schedule.renew()

    def dismiss(self, end: int, voice: str | None = None) -> None:
        """Mark everything before sample `end` as handled, for this voice or for all."""
        self._paths = [
            path
            for path in self._paths
            if (path.words and path.first >= end - DRIFT) or voice not in (None, path.book.voice)
        ]

    def _rest(self) -> None:
        self._active = -1
        for book in self._books:
            book.forget()

    def _break_off(self, at: int) -> None:
        self._paths = []
        self._sound.break_off(at)
        self._schedule.restart(at)
        self._unheard = []
        self._end = self._active = at

    def _firsts(self, greeting: bool) -> list[First]:
        return [
            First(book, word, node, said)
            for book in self._books
            for word, node in self._graph.following[self._graph.start]
            if (word == GREETING) == greeting
            for said in book.said(word, 0)
            if not said.final or node in self._graph.rests
        ]

    def _begin(self, signs: bool) -> None:
        """Start a path for each onset of a sentence."""
        greeted = any(map(_is_greeting, self._paths))
        followed = self.follows
        settled = followed is not None and followed.score >= SETTLED
        for first, at in self._schedule.seek(self._sound, signs, greeted, settled):
            extension = Extension(first.word, first.node, 0, first.said, at)
            self._paths.append(Path(first.book, self._graph.start, at, waiting=[extension]))

    def _follow(self) -> list[Coherent]:
        for path in list(self._paths):
            due = [each for each in path.waiting if self._is_due(each)]
            if due:
                path.waiting = [each for each in path.waiting if not self._is_due(each)]
                self._extend(path, due)
        self._prune()
        found: list[Coherent] = []
        for path in sorted(self._paths, key=lambda p: -p.score):
            if not path.ended or path not in self._paths or self._goes_on(path) or self._may_be_longer(path):
                continue
            if self._is_best(path):
                words = (*self._before(path), *self._words_of(path))
                found.append(Coherent(words, path.book.voice, path.score, path.explained, path.loses, path.gain))
                # A faint similarity in other talk must not end a sentence that somebody else has begun meanwhile.
                self.dismiss(path.end, path.book.voice if path.score < SETTLED else None)
        return found

    def _is_due(self, word: Extension) -> bool:
        """Whether the sentence was heard to its end, wherever it began."""
        return word.end + DRIFT <= self._sound.end

    def _extend(self, path: Path, due: Sequence[Extension]) -> None:
        for each, fit, offset in compared(self._sound, due, path.gain if path.words else None):
            expected = path.gain * fit.expected if path.words else fit.strength
            path.note(each.word, likelihood_of(fit.strength, expected))
            if not passes(fit.strength, expected) or not (fit.whole or path.words):
                continue
            heard = self._sound.heard(each.at + offset, each.end + offset)
            new = path.extended(each, offset, fit.strength, fit.expected, energy_of(heard))
            may_end = each.said.final and each.node in self._graph.finals
            enough = new.score >= (LEAST_SCORE if new.parent else LEAST_ALONE)
            new.ended = may_end and enough and new.thirds == thirds_of(len(new.thirds))
            new.goes_on = bool(self._graph.following[each.node])
            self._paths.append(new)

    def _next(self, path: Path) -> Iterator[Extension]:
        third = path.thirds[-1]
        for word, node in self._graph.following[path.node]:
            for number in {third, min(third + 1, 2)}:
                for said in path.book.said(word, number):
                    if not said.final or node in self._graph.rests:
                        yield Extension(word, node, number, said, path.at - said.lead * path.paused)

    def _prune(self) -> None:
        leader = max((path for path in self._paths if path.words), key=lambda p: p.score, default=None)
        if leader is not None and leader.score >= SETTLED:
            self._paths = [path for path in self._paths if not path.is_hopeless(leader)]
        best: dict[tuple[object, ...], Path] = {}
        for path in sorted(self._paths, key=lambda p: -p.rank):
            if (path.goes_on or path.waiting or path.ended) and (not path.words or path.rank >= LEAST_RANK):
                key = (id(path.book), path.node, path.thirds[-1:], path.words, path.paused, path.at // DRIFT)
                best.setdefault(key, path)
        begun = [path for path in best.values() if not path.words]
        self._paths = begun + [path for path in best.values() if path.words][:BEAM]
        for path in self._paths:
            if path.goes_on:
                path.goes_on, path.waiting = False, list(self._next(path))

    def _may_be_longer(self, path: Path) -> bool:
        """Whether a longer word in place of one of its words fits too, so far."""
        now = self._sound.end
        if path.contested_until is None:
            path.contested_until = now
            for each in path.back():
                before = each.parent
                if before is not None:
                    longer = [w for w in before.waiting if not self._is_due(w) and w.word != each.words[-1]]
                    ends = [rival.end + DRIFT for rival, _, _ in fitting(self._sound, longer, before.gain, now)]
                    path.contested_until = max([path.contested_until, *ends])
        return path.contested_until > now

    def _goes_on(self, path: Path) -> bool:
        """Whether the sentence seems to go on."""
        if not self._graph.following[path.node]:
            return False
        for number, after in enumerate((GOES_ON, GOES_ON_LATER)):
            if len(path.checks) <= number:
                if self._sound.end < path.at + after:
                    return True
                path.checks.append(self._may_go_on(path, path.at + after, after == GOES_ON_LATER))
            if not path.checks[number]:
                return False
        # Some word has begun: it is evaluated when it has ended.
        return not all(self._is_due(each) for each in path.waiting)

    def _may_go_on(self, path: Path, until: int, last: bool) -> bool:
        """Whether any possible next word may have begun in the sound so far."""
        goes_on = False
        for _, fit, _ in fitting(self._sound, list(self._next(path)), path.gain, until):
            goes_on |= not last or fit.expected >= STANDS_OUT or fit.strength >= CHANCE
            path.loses |= last and fit.strength >= SURELY
        return goes_on

    def _before(self, path: Path) -> list[HeardWord]:
        """The word before what sounds like a whole sentence: a name whose beginning was missed."""
        if thirds_of(len(path.words) + 1)[1:] != path.thirds:
            return []
        lead = path.book.said(path.words[0], 0)[0].lead
        places = [
            Extension(word, node, 0, said, path.first + lead - said.advance)
            for word, node in self._graph.following[self._graph.start]
            if self._graph.finals & ends_of(self._graph, node, path.words)
            for said in path.book.said(word, 0)
            if said.final
        ]
        found: list[HeardWord] = []
        for each, fit, offset in fitting(self._sound, places, path.gain):
            if fit.expected >= STANDS_OUT:
                likelihood = likelihood_of(fit.strength, fit.expected)
                start, end = each.at + offset, each.end + offset
                found.append(HeardWord(each.word, start, end, fit.strength / fit.expected, likelihood, each.said))
        return sorted(found, key=lambda word: -word.margin)[:1]

    def _is_best(self, path: Path) -> bool:
        """Whether it is surely a sentence, and no other sentence explains the sound better."""
        rivals = (p for p in self._paths if p.first < path.end and path.words[: len(p.words)] != p.words)
        if any(rival.score > path.score for rival in rivals):
            return False
        path.ended = path.is_best_of_its_words
        return path.ended

    def _words_of(self, path: Path) -> list[HeardWord]:
        steps = list(path.back())[::-1]
        words = []
        for each, after in zip(steps, [*steps[1:], None], strict=True):
            handicap = self._handicap(each, after, path.words[len(each.words) :])
            margin = each.margin(each is path, handicap)
            words.append(HeardWord(each.words[-1], each.start, each.end, each.share, margin, each.said))
        return words

    def _handicap(self, path: Path, after: Path | None, rest: Sequence[str]) -> Callable[[str], float]:
        """The score that another word in place of the last one loses: `after` and the `rest` may not be able to follow
        it."""
        loses = max(after.likelihood - 2.0 * BY_CHANCE, 0.0) if after is not None else 0.0
        source = path.parent.node if path.parent is not None else self._graph.start
        return lambda word: 0.0 if self._graph.finals & ends_of(self._graph, source, (word, *rest)) else loses


def _is_greeting(path: Path) -> bool:
    """Whether the path may begin with a greeting (the next samples will show), or surely does."""
    if not path.words:
        return path.waiting[0].word == GREETING
    return path.words[0] == GREETING and path.score >= LEAST_SCORE
