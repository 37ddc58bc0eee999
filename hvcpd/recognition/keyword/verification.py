"""Keyword verification: whether a detection was a call, part of a sentence, or other talk.

The robot stands still at once and decides afterwards, by the probability of a call and by the sound after it. A call is
accepted in three cases: its probability is high enough; it is repeated, and all together are probable enough; or it
remains when the sentence that was said at that time is subtracted. All other detections are dropped after two seconds.
That costs nothing more, while a stop ends the mission until a person resumes it.

Pure; times and positions are in samples. The thresholds are measured with `benchmarks/stop.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from hvcpd.ports import samples_in
from hvcpd.recognition.events import Held, Recognised, Released, Urgent
from hvcpd.recognition.fitted import logit
from hvcpd.recognition.stream import LONGEST_SENTENCE

KEYWORD_FORMS = frozenset(("stop", "stopped"))
"""Words of a sentence that account for a detection in their place."""
ACCEPT_PROBABILITY = 0.85
"""Probability of a call from which on it counts by itself, chosen on the part `validate` (benchmarks.keyword.curve)."""
SENTENCE_WAIT = samples_in(1.0)
"""Longest wait for a sentence that may end with the word, or may have begun with it: a sentence is reported after
0.5 s of quiet and a search."""
PLAUSIBLE_PROBABILITY = 0.5
"""Probability of a call from which on it counts together with another one. It is reached once in eight minutes of
people's talk, and by one in twenty of their single words."""
RESIDUAL_LOG_ODDS = -2.0
"""Log odds of a call in the residual, below which the sentence alone explains the detection."""
SENTENCE_BASELINE = 0.03
"""Probability of a call that most sentences stay below when they are heard alone."""
JOINT_LOG_ODDS = 1.2
"""Log odds of a call over a sentence, by the sound with it and without it together, from which on it counts."""
WORD_DELAY = samples_in(0.3)
"""Time after the end of the keyword within which the net detects it; its sentence may be reported before."""
CLEAR_PROBABILITY = 0.9
"""Probability of a call from which on it counts against other evidence: of uncertain calls together, since a voice or a
noise is mistaken again and again; of one within a sentence whose samples are unknown; and in the residual of one at a
sentence's beginning. With an automatic gain, which falls at the first sound, sentences alone had 0.83 to 0.87 there
(four of 36 in the world `chain`)."""
POSITION_TOLERANCE = samples_in(0.15)
"""Accuracy of the positions of detections and sentences."""
OPENING_SPAN = samples_in(0.1), samples_in(0.6)
"""Range of the time from the beginning of a sentence to the end of its first word."""
HOLD_TIME = samples_in(2.0)
"""Time for which the robot stands still for an uncertain detection."""
DROPPED_MEMORY = LONGEST_SENTENCE + samples_in(2.0)
"""Time for which a dropped detection is remembered, since the sentence around it may show that it was a call: the
length of that sentence and the rest after it."""
REPEAT_WINDOW = samples_in(6.0)
"""Time after a call within which a person who sees the robots go on may repeat it."""


Verdict = type[Held] | type[Released] | type[Urgent] | None
"""What follows from the latest sound: stand still, go on, or stop; None: nothing new."""


class Residual(NamedTuple):
    """What the keyword net finds in a detection's sound from which a sentence was subtracted."""

    call: float
    """Probability of a call in the residual."""
    share: float
    """Share of the residual, 0 to 1, that is more than the sentence leaves elsewhere; 1 if the sentence explains hardly
    anything even there."""
    alone: float
    """Probability of a call in the sentence alone, as it was received."""

    @property
    def log_odds(self) -> float:
        """Log odds of a call over the sentence. A residual sounds like its sentence, so it says less where the sentence
        explains much of the sound, or resembles the keyword by itself ("hi Siobhan")."""
        if self.share <= 0.0:
            return -math.inf
        return logit(self.call) + math.log(self.share) - max(logit(self.alone) - logit(SENTENCE_BASELINE), 0.0)


ResidualWithout = Callable[[Recognised, int, int], Residual | None]
"""The residual of a sentence between two samples; None if it is unknown."""


@dataclass(frozen=True)
class _Detection:
    start: int
    end: int
    probability: float
    first_heard: int
    accept_from: int
    """The time from which on a sufficient probability is accepted."""
    heard_again: bool = False
    """Its probability is that of two hearings."""
    pending: bool = True
    """Not decided yet. What is dropped counts if the call is repeated, or remains when a sentence is subtracted."""

    @property
    def is_sure(self) -> bool:
        return self.probability >= ACCEPT_PROBABILITY

    @property
    def adds_up(self) -> bool:
        """Whether its log odds count together with those of other calls."""
        return self.heard_again and self.probability >= PLAUSIBLE_PROBABILITY

    def is_within(self, sentence: Recognised) -> bool:
        starts_within = sentence.start_sample - POSITION_TOLERANCE <= self.start
        return starts_within and self.end <= sentence.end_sample + POSITION_TOLERANCE

    def opens(self, sentence: Recognised) -> bool:
        """Whether the sentence began with it."""
        return OPENING_SPAN[0] <= self.end - sentence.start_sample <= OPENING_SPAN[1]

    def is_word_of(self, sentence: Recognised) -> bool:
        """Whether the sentence has the keyword, or a word that includes it, in this place."""
        there = (span for span in sentence.spans if span.start_sample < self.end and self.start < span.end_sample)
        return any(span.word in KEYWORD_FORMS for span in there)

    def remains(self, residual: Residual) -> bool:
        """Whether it is certain, by the sound with the sentence and without it together. A sentence that noise hides
        cannot be subtracted, so that the residual only says again what the sound says."""
        return residual.share < 1.0 and logit(self.probability) + residual.log_odds >= JOINT_LOG_ODDS


class CallVerifier:
    """Takes detections and sentences in the order of their reports. After `Released` or `Urgent` none is pending."""

    def __init__(self, residual: ResidualWithout) -> None:
        self._residual = residual
        self._detections: list[_Detection] = []
        self._last_sentence: Recognised | None = None
        """It may have been reported before the detection in it."""
        self._recheck_at: int | None = None
        """When that sentence is compared with the detections again."""
        self._accepted = -1
        """Where the last word began that counted as a call."""

    @property
    def pending(self) -> bool:
        """Whether a detection is not decided yet."""
        return any(d.pending for d in self._detections)

    def is_uncertain(self, start: int) -> bool:
        """Whether the detection from sample `start` on is not decided yet, and not probable enough by itself."""
        return any(d.start == start and not d.is_sure for d in self._detections)

    def detected(
        self,
        start: int,
        end: int,
        probability: float,
        now: int,
        awaited: bool = False,
        followed: bool = False,
        again: bool = False,
    ) -> Verdict:
        """Take a detection between two samples, or its higher probability; or, if it was heard `again`, its last one.
        `awaited`: a sentence may soon account for it; `followed`: a sentence in progress seems to, so that the robot
        stands still only if it is certain."""
        if start <= self._accepted:
            return None  # the same word, more probable
        before = next((d for d in self._detections if d.start == start), None)
        detection = _Detection(start, end, probability, now, now + (SENTENCE_WAIT if awaited else 0))
        if before is not None:
            latest = probability if again else max(probability, before.probability)
            detection = replace(before, end=end, probability=latest, heard_again=again)
        if self._last_sentence is not None and self._belongs_to(self._last_sentence, detection):
            return None
        self._recheck_at = self._recheck_at or now + WORD_DELAY
        self._detections = [d for d in self._detections if d.start != start]
        if self._is_certain(detection) and now >= detection.accept_from:
            self._detections.append(detection)
            return self._accept()
        pending = before is not None and before.pending
        held = pending or detection.is_sure or not followed
        self._detections.append(replace(detection, pending=held))
        return Held if held and not pending else None

    def recognised(self, sentence: Recognised) -> Verdict:
        """Take a sentence that was recognised."""
        self._last_sentence = sentence
        explained = []
        end = sentence.end_sample - POSITION_TOLERANCE
        before = (d for d in self._detections if d.start < end)
        for detection in [d for d in before if d.is_within(sentence) or d.opens(sentence)]:
            residual = self._residual(sentence, detection.start, detection.end)
            if _explains(sentence, detection, residual):
                explained.append(detection)
            elif detection.is_within(sentence) if residual is None else detection.remains(residual):
                return self._accept()
        is_news = any(d.pending for d in explained)
        self._detections = [d for d in self._detections if d not in explained]
        return Released if is_news and not self.pending else None

    def not_recognised(self, until: float = math.inf) -> Verdict:
        """Note that speech up to sample `until` was not understood, or was lost. What was said later may still be."""
        self._last_sentence = None
        pending = (d for d in self._detections if d.pending and d.start < until)
        return self._accept() if any(map(self._is_certain, pending)) else None

    def advance(self, now: int, in_progress: bool = False) -> Verdict:
        """Let time go on to sample `now`. `in_progress`: a sentence surely is; a detection waits for it, since that may
        account for it."""
        if in_progress:
            until = now + SENTENCE_WAIT
            self._detections = [replace(d, accept_from=until) if d.pending else d for d in self._detections]
        if self._recheck_at is not None and now >= self._recheck_at:
            self._recheck_at = None
            if self._last_sentence is not None and (verdict := self.recognised(self._last_sentence)) is not None:
                return verdict
        waiting = [d for d in self._detections if d.pending]
        certain = [d for d in waiting if self._is_certain(d)]
        if any(now >= d.accept_from for d in certain):
            return self._accept()
        expired = [d for d in waiting if d not in certain and now - d.first_heard >= HOLD_TIME]
        self._detections = [
            replace(d, pending=d.pending and d not in expired)
            for d in self._detections
            if d.pending or now - d.first_heard < DROPPED_MEMORY
        ]
        return Released if expired and not self.pending else None

    def _is_certain(self, detection: _Detection) -> bool:
        """Whether it is, by itself or with the unexplained detections shortly before it: as independent observations,
        their log odds add up."""
        earlier = [
            logit(d.probability)
            for d in self._detections
            if d.end - POSITION_TOLERANCE <= detection.start
            and detection.first_heard - d.first_heard <= REPEAT_WINDOW
            and d.adds_up
        ]
        together = logit(detection.probability) + sum(earlier)
        repeated = bool(earlier) and detection.adds_up
        return detection.is_sure or (repeated and together >= logit(CLEAR_PROBABILITY))

    def _accept(self) -> Verdict:
        self._accepted = max(d.start for d in self._detections)
        self._detections.clear()
        return Urgent

    def _belongs_to(self, sentence: Recognised, detection: _Detection) -> bool:
        """Whether a sentence that was reported earlier accounts for it, or cannot be subtracted yet."""
        if not detection.is_within(sentence):
            return False
        return detection.is_word_of(sentence) or self._residual(sentence, detection.start, detection.end) is None


def _explains(sentence: Recognised, detection: _Detection, residual: Residual | None) -> bool:
    """Whether nothing but the sentence was heard where the detection is, within it or at its beginning. A sentence
    whose samples are unknown says nothing of a very probable call."""
    if residual is None:
        is_its_own = detection.is_word_of(sentence) or detection.probability < CLEAR_PROBABILITY
        return detection.is_within(sentence) and is_its_own
    if detection.opens(sentence):
        return residual.call < CLEAR_PROBABILITY
    return residual.log_odds < RESIDUAL_LOG_ODDS
