"""Whether what sounded like the urgent word over talk was that word, or the talk itself. Pure; time is in samples.

Under a voice as loud, the word can be told from some other talk only by what is said around it. So whoever hears it
stands still first and decides afterwards: when the sentence that it was heard in is understood, and each word of it
that was said at that time is sure, nobody said anything over it. In every other case somebody may have, and it counts
as said, but for one: some phrases of the robots sound like the word where two of them speak at once, and if such a
phrase was found there as well, it is as likely to have been that. Then whoever heard it stands for a while, in which
the next word that has no such excuse counts at once, and goes on if there is none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised, WordSpan


class Verdict(Enum):
    """What became of the word by what was heard last."""

    UNCHANGED = "nothing new"
    HELD = "somebody may have said it; later calls will tell"
    RELEASED = "it was other talk"
    SAID = "somebody said it"


@dataclass(frozen=True)
class HoldSettings:
    """How other talk is known; measured with `benchmarks/stop.py`."""

    certain_score: float = 0.65
    """A share of the word that is told at once; "stopped" has shown 0.55 of it."""
    most_excess: float = 0.3
    """So much more of the word may be found than the sentence shows by itself (`lookalike`). Alone, 0.23 at most; under
    a call as loud, 0.37 and more where the words look sure."""
    sentence_confidence: float = 0.9
    most_deficit: float = 0.25
    """Of each word of the sentence that was said at the same time (`WordSpan.deficit`). Alone, 0.12 at most; under a
    call as loud, 0.36 and more where the sentence itself looks like the word."""
    most_own_deficit: float = 0.5
    """Of the word in the sentence itself, or of "stopped": with more, somebody else's covers it. A call as loud over "I
    have stopped" left that sentence understood, with 0.66 (1 is another word)."""
    edge_s: float = 0.1
    """How well the ends of the word are known, and those of a sentence."""
    quiet_s: float = 1.0
    """Speech that has ended for so long becomes no sentence any more."""
    longest_s: float = 8.0
    """As long as sentences take with the rest after it; whoever has not ended by then only talks on."""
    excuse_lag: float = 0.25
    """A phrase that sounds like the word excuses it if this much less of the phrase was found, or more. Of 179 calls
    at 0 dB over a robot 1 has such a phrase (15 of 100 over Rob); of 46 collisions that sounded like the word 42."""
    doubt_s: float = 6.0
    """Whoever sees the robots stand after a call that was not sure has so long to say it again."""


Alone = Callable[[Recognised, int, int], float]
"""How much of the word a sentence shows by itself between two samples, as scores go."""
Subtracted = Callable[[Recognised, int, int], bool]
"""Whether nothing of the word is left between two samples once the sentence, known to the sample, is taken out."""


@dataclass(frozen=True)
class _Word:
    start: int
    end: int
    score: float
    excused: bool


class Hold:
    """Tell it what the recogniser finds. After RELEASED or SAID nothing is held."""

    def __init__(
        self,
        texts: frozenset[str],
        alone: Alone,
        settings: HoldSettings | None = None,
        subtracted: Subtracted = lambda _sentence, _start, _end: False,
    ) -> None:
        """`texts`: the words that are heard as the urgent one, as they are written, itself among them."""
        self._settings = settings or HoldSettings()
        self._alone = alone
        self._subtracted = subtracted
        self._texts = texts
        self._open: list[_Word] = []
        self._since = 0
        self._told: Recognised | None = None
        """The sentence that was understood last; it may be told before the word in it is."""
        self._now = 0
        self._doubt_until: int | None = None

    @property
    def held(self) -> bool:
        """Whether a word is not decided yet."""
        return bool(self._open) or self._doubt_until is not None

    def word(self, start: int, end: int, score: float, now: int, excuse: float = -math.inf) -> Verdict:
        """The word was heard from sample `start` to `end`; `score` of it was found, `excuse` of a phrase like it."""
        if score >= self._settings.certain_score:
            return self._said()
        self._now = max(self._now, now)
        word = _Word(start, end, score, excuse >= score - self._settings.excuse_lag)
        if self._told is not None and self._explains(self._told, word):
            return Verdict.UNCHANGED
        if self._doubt_until is not None and not word.excused:
            return self._said()
        self._since = self._since if self._open else now
        self._open.append(word)
        return Verdict.HELD

    def sentence(self, sentence: Recognised) -> Verdict:
        """A sentence was understood."""
        self._told = sentence
        edge = round(self._settings.edge_s * SAMPLE_RATE_HZ)
        reached = [word for word in self._open if word.start < sentence.end_sample - edge]
        if not all(self._explains(sentence, word) for word in reached):
            return self._likely()
        self._open = [word for word in self._open if word not in reached]
        return Verdict.RELEASED if reached and not self.held else Verdict.UNCHANGED

    def unclear(self) -> Verdict:
        """Speech was not understood, or was lost."""
        self._told = None
        return self._likely() if self._open else Verdict.UNCHANGED

    def at(self, now: int, quiet_since: int) -> Verdict:
        """Time went on to sample `now`; nobody has spoken from `quiet_since` on."""
        s = self._settings
        self._now = now
        over = now - quiet_since >= s.quiet_s * SAMPLE_RATE_HZ or now - self._since >= s.longest_s * SAMPLE_RATE_HZ
        if self._open:
            return self._likely() if over else Verdict.UNCHANGED
        if self._doubt_until is None or now < self._doubt_until:
            return Verdict.UNCHANGED
        self._doubt_until = None
        return Verdict.RELEASED

    def _likely(self) -> Verdict:
        """Somebody may have said it: it counts, unless robots' phrases excuse all that was heard."""
        if not all(word.excused for word in self._open):
            return self._said()
        self._open.clear()
        self._doubt_until = self._now + round(self._settings.doubt_s * SAMPLE_RATE_HZ)
        return Verdict.UNCHANGED

    def _said(self) -> Verdict:
        self._open.clear()
        self._doubt_until = None
        return Verdict.SAID

    def accounts(self, sentence: Recognised) -> bool:
        """Whether the word, or one that holds it, was heard in the sentence and nothing else at that time."""
        return any(self._is_said(span) for span in sentence.spans)

    def _is_said(self, span: WordSpan) -> bool:
        return span.word in self._texts and span.deficit <= self._settings.most_own_deficit

    def _explains(self, sentence: Recognised, word: _Word) -> bool:
        """Whether nothing but the sentence was heard where the word was."""
        s = self._settings
        edge = round(s.edge_s * SAMPLE_RATE_HZ)
        if word.start < sentence.start_sample - edge or word.end > sentence.end_sample + edge:
            return False
        there = [span for span in sentence.spans if span.start_sample < word.end and word.start < span.end_sample]
        if any(self._is_said(span) for span in there):
            return True  # the word was said in the sentence; whom it was meant for is told there
        if not there or sentence.confidence < s.sentence_confidence:
            return False
        if self._subtracted(sentence, word.start, word.end):
            return True  # the sound itself shows it: how well each word fits tells no more
        sure = all(span.deficit <= s.most_deficit for span in there)
        return sure and word.score <= self._alone(sentence, word.start, word.end) + s.most_excess
