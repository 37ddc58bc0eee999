"""The keyword stage of the recogniser: reports when to stand still, to go on, and to stay stopped."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from hvcpd.language.words import KEYWORD
from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.fitted import logistic, logit
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, energies_of, power_ratio
from hvcpd.recognition.keyword.net import HOLD_PROBABILITY, Detection, KeywordNet, KeywordSpotter, Posteriors, peak_of
from hvcpd.recognition.keyword.verification import (
    ACCEPT_PROBABILITY,
    PLAUSIBLE_PROBABILITY,
    WORD_DELAY,
    CallVerifier,
    Residual,
    Verdict,
)
from hvcpd.recognition.stages import Reception, Stage
from hvcpd.recognition.stream import CHUNK_FRAMES, CHUNK_SAMPLES, Chunk, History
from hvcpd.recognition.template_recogniser import TemplateRecogniser

LAST_WORD_SPAN = samples_in(0.8)
"""Time before the end of a sentence within which the net detects its last word."""
LEAST_EXPLAINED = 0.1
"""Share of a sentence's power that its known samples must explain before it is subtracted from a detection."""
CALL_DELAY = samples_in(0.75)
"""Time after the end of the keyword within which the net decides whether it was a call."""
MAX_SPANS = 32
"""Number of detections in half a minute at most: a sentence is reported within 13 s of its beginning."""
REHEARD_BEFORE = samples_in(1.5)
"""Time before a detection with which the net starts again."""
NOISE_POWER = 0.1
"""Power of the noise added to an uncertain detection, relative to its mean power (-10 dB)."""
ECHO_RISE_DB = 10.0
"""Least rise of the sound after the robot's own voice by which a detection there is a word: what fades with the room's
echo rises by its own and the noise's irregularities alone (`benchmarks.own_echo`)."""
CHECKED_BEFORE = samples_in(1.6)
"""Length of the sound, up to the keyword's end, by which a call is checked: the keyword, a name, and what precedes."""
CHECKED_FLOOR = 0.71
"""Probability that is left of a certain call at least if the check objects: three of them are certain, so that nobody
calls in vain."""

USUAL_GAIN = 25.0
"""Gain of a robot's sentence (`DecoderSession`) up to which a call over it is likely; sentences alone have 25 to 45."""
NATS_PER_GAIN = 0.04
"""Nats by which each unit beyond that lowers the log odds of a detection (docs/decisions/keyword.md)."""

CallCheck = Callable[[Samples], float]
"""Nats by which another listener lowers the log odds of a call, given the sound from CHECKED_BEFORE before the
keyword's end on."""


class KeywordRescorer:
    """Applies the net to a detection again, in the recent sound without a sentence, or with noise."""

    def __init__(self, net: KeywordNet, history: History) -> None:
        """`net`: an instance of its own, since it starts again each time. `history`: the sound of the chunks."""
        self._net = net
        self._history = history
        self.begin = self._end = 0
        """The first and the last sample of the sound of consecutive chunks, up to the newest."""

    def push(self, chunk: Chunk) -> None:
        """Note the next frames."""
        first = chunk.first_frame * HOP_SAMPLES
        if first != self._end:
            self.begin = first
        self._end = first + len(chunk.energies) * HOP_SAMPLES

    def sound_since(self, start: int) -> Samples | None:
        """The sound from sample `start` on; None if that is not kept."""
        return self._history.between(start, self._end) if start >= self.begin else None

    def residual(self, sentence: Recognised, start: int, end: int) -> Residual | None:
        """The residual of a sentence between samples `start` and `end`; None if the sentence's samples are unknown, or
        the sound is no longer kept.

        A robot's sentence may partly mask a call, and a sentence and other talk together may sound like a call that
        nobody made. Subtracted, it leaves the call alone (as radio receivers cancel the stronger signal: P. Patel & J.
        Holtzman, "Analysis of a simple successive interference cancellation scheme", IEEE JSAC 12(5), 1994).
        """
        if sentence.received is None or (around := self._around(start, end)) is None:
            return None
        first, heard = around
        alone = sentence.received.between(first, len(heard))
        spoken = slice(max(sentence.start_sample - first, 0), max(sentence.end_sample - first, 0))
        word = slice(start - first, end - first)
        share = _share_beyond_sentence(heard, heard - alone, word, spoken)
        if share <= 0.0:
            return Residual(0.0, 0.0, 0.0)
        left, like = (self._posteriors(sound, word.start, word.stop) for sound in (heard - alone, alone))
        return Residual(max(left), share, max(like)) if left is not None and like is not None else None

    def with_noise(self, start: int, end: int) -> Posteriors | None:
        """The highest posteriors between two samples, with white noise of NOISE_POWER added; None if the sound is no
        longer kept.

        A false alarm in an unfamiliar voice hardly survives a little noise, so the mean of both answers is more
        reliable than either (test-time augmentation: G. Wang et al., "Aleatoric uncertainty estimation with test-time
        augmentation", Neurocomputing 338, 2019).
        """
        if (around := self._around(start, end)) is None:
            return None
        first, heard = around
        power = NOISE_POWER * np.mean(np.square(heard[start - first : end - first]))
        return self._posteriors(heard + np.sqrt(power) * _white(len(heard)), start - first, end - first)

    def _around(self, start: int, end: int) -> tuple[int, Samples] | None:
        """The sound around a detection between two samples that the net needs, and its first sample."""
        first = max(start - REHEARD_BEFORE, self.begin, self._history.begin)
        sound = self.sound_since(first) if first <= start else None
        return (first, sound[: end + CALL_DELAY - first]) if sound is not None else None

    def _posteriors(self, sound: Samples, start: int, end: int) -> Posteriors | None:
        energies = energies_of(sound)
        chunks = energies[: len(energies) // CHUNK_FRAMES * CHUNK_FRAMES].reshape(-1, CHUNK_FRAMES, N_BANDS)
        self._net.reset()
        probabilities = [self._net.posteriors(chunk) for chunk in chunks][start // CHUNK_SAMPLES :]
        in_word = (end + WORD_DELAY - start) // CHUNK_SAMPLES
        word = peak_of([each.word for each in probabilities[:in_word]])
        call = peak_of([each.call for each in probabilities])
        return Posteriors(word, call) if word is not None and call is not None else None


def _share_beyond_sentence(heard: Samples, rest: Samples, word: slice, spoken: slice) -> float:
    """The share, 0 to 1, of the residual `rest` of `heard` at a detection that is more than the sentence leaves in the
    other samples in which it was `spoken`: a poorly known sentence leaves a part of itself everywhere."""
    before, after = slice(spoken.start, min(word.start, spoken.stop)), slice(max(word.stop, spoken.start), spoken.stop)
    beside = _explained_share(heard, rest, before, after)
    if beside < LEAST_EXPLAINED:
        return 1.0
    there = _explained_share(heard, rest, word)
    return (beside - there) / (1.0 - there) if there < beside else 0.0


def _explained_share(heard: Samples, rest: Samples, *where: slice) -> float:
    """The share of the power of `heard` there that is not in `rest`; 0 where there is no sound."""
    total, left = (
        sum(float(np.sum(np.square(sound[each], dtype=np.float64))) for each in where) for sound in (heard, rest)
    )
    return 1.0 - left / total if total > 0.0 else 0.0


def _white(n: int) -> Samples:
    """White noise of power 1, the same each time: a hash of each sample's number (A. Appleby, MurmurHash3, 2011)."""
    hashed = np.arange(n, dtype=np.uint32)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        hashed ^= hashed >> shift
        hashed *= np.uint32(factor)
    return np.asarray(hashed.view(np.int32) * np.float32(np.sqrt(3.0) / 2.0**31), np.float32)


class KeywordStage(Stage):
    """Detects the keyword, in any voice and over any other sound."""

    def __init__(
        self, first_pass: TemplateRecogniser, net: KeywordNet, rescorer: KeywordRescorer, check: CallCheck
    ) -> None:
        super().__init__(first_pass)
        self._check = check
        self._spotter = KeywordSpotter(net)
        self._rescorer = rescorer
        self._verifier = CallVerifier(rescorer.residual)
        self._detection: Detection | None = None
        """The last detection, until it is reconsidered."""
        self._after_own = False
        """Whether it was the robot's own voice that interrupted the sound last."""
        self._excess_gain = 0.0
        """Gain beyond USUAL_GAIN of a robot's sentence in progress when it was first detected."""
        self._span = (0, 0)
        self._spans: deque[tuple[int, int]] = deque(maxlen=MAX_SPANS)
        """The first and the last sample of the recent detections."""

    def take(self, events: Sequence[Event], how: Reception, n_samples: int) -> list[Event]:  # noqa: ARG002
        """As `Stage.take`."""
        if how in (Reception.OWN, Reception.LOST):
            self._after_own = how is Reception.OWN
        events = [self._checked(event) for event in events]
        following = [each for event in events for each in self._after(event)]
        for chunk in self.first_pass.chunks:
            following += self._detect(chunk)
        if how is not Reception.HEARD:
            following += self._as_events(self._verifier.not_recognised())
        return [*events, *following]

    def _detect(self, chunk: Chunk) -> list[Event]:
        session = self.first_pass.session
        self._rescorer.push(chunk)
        now = (chunk.first_frame + len(chunk.energies)) * HOP_SAMPLES
        events: list[Event] = []
        found = self._spotter.push(chunk)
        if found is not None and not self._only_fades(found):
            if self._detection is None or found.start != self._detection.start:
                events += self._reconsider(now)
                self._excess_gain = max(session.gain - USUAL_GAIN, 0.0) if session.ending_word != KEYWORD else 0.0
            self._detection = found
            self._span = (found.start, found.end)
            self._spans.append(self._span)
            events += self._verify(found, found.call, now)
        if now >= self._span[1] + CALL_DELAY:
            events += self._reconsider(now)
        return events + self._as_events(self._verifier.advance(now, session.surely_under_way))

    def _reconsider(self, now: int) -> list[Event]:
        """Apply the net again, with noise, to the last detection if it is still uncertain: all of it has been heard, or
        another one begins."""
        found, self._detection = self._detection, None
        if found is None or not self._verifier.is_uncertain(self._span[0]):
            return []
        again = self._rescorer.with_noise(*self._span)
        if again is None:
            return []
        return self._verify(found, logistic((logit(found.call) + logit(again.call)) / 2.0), now, again=True)

    def _verify(self, found: Detection, call: float, now: int, again: bool = False) -> list[Event]:
        """What follows from the probability that the last detection was a call, which is checked if it counts; `again`:
        by two hearings."""
        if call >= PLAUSIBLE_PROBABILITY:
            sound = self._rescorer.sound_since(self._span[1] - CHECKED_BEFORE)
            nats = self._check(sound) if sound is not None else 0.0
            checked = logistic(logit(call) - nats)
            call = max(checked, CHECKED_FLOOR) if checked < ACCEPT_PROBABILITY <= call else checked
        session = self.first_pass.session
        awaited = bool(session.ending_word) or session.surely_under_way
        # Whether a robot's sentence explains the detection better than a call over it would.
        followed = logit(found.probability) - NATS_PER_GAIN * self._excess_gain < logit(HOLD_PROBABILITY)
        return self._as_events(self._verifier.detected(*self._span, call, now, awaited, followed, again))

    def _only_fades(self, found: Detection) -> bool:
        """Whether a detection that seems to begin in the robot's own voice is nothing but its echo: to the net, which
        heard quiet before, that is a sudden sound; a word would rise above it."""
        begin = self._rescorer.begin
        interrupts = self._after_own and begin > found.start
        sound = self._rescorer.sound_since(begin) if interrupts else None
        if sound is None:
            return False
        powers = energies_of(sound).sum(axis=1)
        return bool((powers < power_ratio(ECHO_RISE_DB) * np.minimum.accumulate(powers)).all())

    def _checked(self, event: Event) -> Event:
        """The event; or garbled speech if a sentence that ends with the keyword is not certain, or the net did not
        detect the word: a search over the phrasebook finds it in "staff" and "step", too."""
        if not isinstance(event, Recognised) or event.words[-1] != KEYWORD:
            return event
        begin, end = event.end_sample - LAST_WORD_SPAN, event.end_sample + WORD_DELAY
        heard = any(start < end and begin < last for start, last in self._spans)
        is_call = heard and event.confidence >= ACCEPT_PROBABILITY
        return event if is_call else Garbled(event.start_sample, event.end_sample)

    def _after(self, event: Event) -> list[Event]:
        if isinstance(event, Recognised):
            return self._as_events(self._verifier.recognised(event))
        return self._as_events(self._verifier.not_recognised(event.end_sample))

    def _as_events(self, verdict: Verdict) -> list[Event]:
        """The verdict as an event at the position of the last detection."""
        return [verdict(*self._span)] if verdict is not None else []
