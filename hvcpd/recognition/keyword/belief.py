"""Decides whether the net detected the keyword or other talk. Pure; time is in samples. The thresholds are measured
with `benchmarks/stop.py`.

The robot stands still first and decides afterwards, by the probability of a call and by the sound after it. The word
counts as said in three cases: it is certain; it is heard again, and both together are certain; or it is still heard
once the sentence that was said at that time is subtracted. A less certain word is dropped after two seconds. That costs
nothing else, while a stop ends the mission until a person resumes it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Held, Recognised, Released, Urgent
from hvcpd.recognition.fitted import logit

TEXTS = frozenset(("stop", "stopped"))
"""Words of which one in a sentence accounts for the detection."""
CERTAIN = 0.85
"""A chance of a call from which it counts, unless a sentence may be about to end with it; chosen on the part `validate`
(`benchmarks.keyword.curve`)."""
SENTENCE_WAIT = SAMPLE_RATE_HZ
"""Longest wait (1 s) for a sentence that may be about to end with the word, or began with it and goes on no more: it is
reported after 0.5 s of quiet and a search."""
FAIR = 0.5
"""Least probability that counts towards CERTAIN with other calls. Of people's talk one piece in eight minutes has it,
of their single words one in twenty."""
LEFT = -2.0
"""Log odds of the residual from which on it may contain the word."""
UNLIKE = 0.03
"""Probability of a call by a sentence that does not sound like the word: most have less."""
BOTH = 0.5
"""Least log odds of a word that was said over a sentence, by the sound with the sentence and without it together
(docs/decisions/keyword.md)."""
LATE = 3 * SAMPLE_RATE_HZ // 10
"""Longest part (0.3 s) of a word that may still arrive after its sentence was reported."""
BEGUN = 0.9
"""Least probability of a call at the beginning of a sentence, once that is removed: with an automatic gain, which falls
at the first sound, sentences themselves had 0.83 to 0.87 there (four of 36 in the world `chain`)."""
EDGE = 3 * SAMPLE_RATE_HZ // 20
"""How well (0.15 s) the ends of the word are known, and those of a sentence."""
OPENING = SAMPLE_RATE_HZ // 10, 3 * SAMPLE_RATE_HZ // 5
"""Range of the time (0.1 to 0.6 s) from the beginning of a sentence to the end of a word there."""
OPENED = 3 * SAMPLE_RATE_HZ // 10
"""A word that begins this soon (0.3 s) after a sentence was first seen may be at its beginning: "hi Siobhan"."""
REMEMBERED = 12 * SAMPLE_RATE_HZ
"""Time (12 s) for which a dropped word is remembered: the length of a sentence and the rest after it, since that may
show that the word was said."""
DOUBT = 2 * SAMPLE_RATE_HZ
"""Time (2 s) for which the robot stands still for a word that is not certain."""
AGAIN = 6 * SAMPLE_RATE_HZ
"""Time (6 s) after the first call in which a person who sees the robots go on can say it again."""


Verdict = type[Held] | type[Released] | type[Urgent] | None
"""What follows from the latest sound: stand still, go on, or stop; None: nothing new."""


class Residual(NamedTuple):
    """What is left of the sound of a word once a sentence is removed from it."""

    call: float
    """The probability, by the residual, that a call was said."""
    share: float
    """The share of it, 0 to 1, that this sentence does not leave elsewhere."""
    alone: float
    """The probability of a call by the sentence alone, as it is known to have been received."""

    @property
    def log_odds(self) -> float:
        """The log odds that somebody called over the sentence. What is left of a sentence sounds like itself: so the
        residual tells less where the sentence explains much, or sounds like the word by itself ("hi Siobhan")."""
        if self.share <= 0.0:
            return -math.inf
        return logit(self.call) + math.log(self.share) - max(logit(self.alone) - logit(UNLIKE), 0.0)


Left = Callable[[Recognised, int, int], Residual | None]
"""The residual between two samples without a sentence; None: unknown."""


@dataclass(frozen=True)
class _Word:
    start: int
    end: int
    probability: float
    told: int
    """When it was first heard."""
    certain_from: int
    """The time from which on it counts if it is certain."""


def may_open(since: int | None, start: int) -> bool:
    """Whether the word from sample `start` on may be at the beginning of a sentence that was first seen at `since`."""
    return since is not None and start <= since + OPENED


class Belief:
    """Takes words and sentences as they are heard. After `Released` or `Urgent` nothing is held."""

    def __init__(self, left: Left) -> None:
        self._left = left
        self._open: list[_Word] = []
        self._told: Recognised | None = None
        """The last sentence; it may be reported before the word in it."""
        self._ask_from: int | None = None
        """The time at which the sentence reported before a word is checked against it."""
        self._let_go: list[_Word] = []
        """Words that were not certain enough; they count if they are said again, or remain after a sentence is
        removed."""

    @property
    def held(self) -> bool:
        """Whether a word is not decided yet."""
        return bool(self._open)

    def doubts(self, start: int) -> bool:
        """Whether the word from sample `start` on is not decided yet, and not certain."""
        return any(w.start == start and not self._is_sure(w) for w in (*self._open, *self._let_go))

    def word(
        self, start: int, end: int, probability: float, now: int, awaited: bool = False, followed: bool = False
    ) -> Verdict:
        """The word was heard from sample `start` to `end`, or with more certainty than before; `awaited`: a
        sentence may soon account for it; `followed`: one in progress seems to, so that nobody stands still for it
        unless it is certain."""
        held = any(w.start == start for w in self._open)
        before = [w for w in (*self._open, *self._let_go) if w.start == start]
        wait = now + (SENTENCE_WAIT if awaited else 0)
        told, wait = (before[0].told, before[0].certain_from) if before else (now, wait)
        word = _Word(start, end, max([probability, *(w.probability for w in before)]), told, wait)
        if self._told is not None and self._accounts_for(self._told, word):
            return None
        self._ask_from = self._ask_from or now + LATE
        self._open = [w for w in self._open if w.start != start]
        self._let_go = [w for w in self._let_go if w.start != start]
        if self._is_said_again(word) or self._is_certain(word, now):
            return self._said()
        if followed and not held and not self._is_sure(word):
            self._let_go.append(word)
            return None
        self._open.append(word)
        return None if held else Held

    def sentence(self, sentence: Recognised) -> Verdict:
        """A sentence was understood."""
        self._told = sentence
        explained = []
        for word in [w for w in (*self._open, *self._let_go) if w.start < sentence.end_sample - EDGE]:
            is_there = self._is_within(sentence, word) or self._is_opened(sentence, word)
            left = self._left(sentence, word.start, word.end) if is_there else None
            if self._explains(sentence, word, left):
                explained.append(word)
            elif left is not None and self._is_over(word, left):
                return self._said()
        is_news = any(word in self._open for word in explained)
        self._open = [word for word in self._open if word not in explained]
        self._let_go = [word for word in self._let_go if word not in explained]
        return Released if is_news and not self.held else None

    def unclear(self) -> Verdict:
        """Speech was not understood, or was lost."""
        self._told = None
        return self._said() if any(map(self._is_sure, self._open)) else None

    def at(self, now: int, since: int | None = None) -> Verdict:
        """Time went on to sample `now`; `since`: where a sentence in progress was first seen. A word that it may have
        begun with waits for it."""
        wait = now + SENTENCE_WAIT
        self._open = [replace(w, certain_from=wait) if may_open(since, w.start) else w for w in self._open]
        if self._ask_from is not None and now >= self._ask_from:
            self._ask_from = None
            if self._told is not None and (verdict := self.sentence(self._told)) is not None:
                return verdict
        if any(self._is_certain(word, now) for word in self._open):
            return self._said()
        self._let_go = [w for w in self._let_go if now - w.told < REMEMBERED]
        weak = [w for w in self._open if not self._is_sure(w) and now - w.told >= DOUBT]
        if not weak:
            return None
        self._let_go += weak
        self._open = [word for word in self._open if word not in weak]
        return None if self.held else Released

    def _is_certain(self, word: _Word, now: int) -> bool:
        return self._is_sure(word) and now >= word.certain_from

    def _is_sure(self, word: _Word) -> bool:
        return word.probability >= CERTAIN

    def _is_over(self, word: _Word, left: Residual) -> bool:
        """Whether it was said over a sentence: `left` is what the residual tells."""
        return logit(word.probability) + left.log_odds >= BOTH

    def _is_said_again(self, word: _Word) -> bool:
        """Whether this word and the unexplained ones shortly before it are certain together: as independent
        observations, their log odds add up."""
        before = [w for w in (*self._open, *self._let_go) if w.end - EDGE <= word.start]
        fair = [w.probability for w in before if word.told - w.told <= AGAIN and w.probability >= FAIR]
        together = logit(word.probability) + sum(map(logit, fair))
        return bool(fair) and word.probability >= FAIR and together >= logit(CERTAIN)

    def _said(self) -> Verdict:
        self._open.clear()
        self._let_go.clear()
        return Urgent

    def _is_within(self, sentence: Recognised, word: _Word) -> bool:
        return sentence.start_sample - EDGE <= word.start and word.end <= sentence.end_sample + EDGE

    def _is_opened(self, sentence: Recognised, word: _Word) -> bool:
        """Whether the sentence began with the word."""
        return OPENING[0] <= word.end - sentence.start_sample <= OPENING[1]

    def _accounts_for(self, told: Recognised, word: _Word) -> bool:
        """Whether a sentence reported earlier explains it: the residual without that sentence is not complete yet."""
        if not self._is_within(told, word):
            return False
        return self._shows(told, word) or self._left(told, word.start, word.end) is None

    def _shows(self, sentence: Recognised, word: _Word) -> bool:
        """Whether the sentence contains the word, or one that includes it, at this place."""
        there = [span for span in sentence.spans if span.start_sample < word.end and word.start < span.end_sample]
        return any(span.word in TEXTS for span in there)

    def _explains(self, sentence: Recognised, word: _Word, left: Residual | None) -> bool:
        """Whether only the sentence was heard where the word was detected."""
        if left is not None and self._is_opened(sentence, word):
            return left.call < BEGUN
        return self._is_within(sentence, word) and (left is None or left.log_odds < LEFT)
