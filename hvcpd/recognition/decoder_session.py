"""The decoder session: scores frames, advances the decoder, detects the end of a sentence, and gives its confidence."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import astuple, dataclass
from itertools import pairwise

import numpy as np

from hvcpd.recognition.decoder import BestPath, Decoder, TracedWord
from hvcpd.recognition.fitted import fitted_probability
from hvcpd.recognition.frontend import CONTEXT_FRAMES, SILENT_POWER, Energies, decibels, features_of, power_ratio
from hvcpd.recognition.network import HORIZON_FRAMES, Beam, Network
from hvcpd.recognition.stream import FrameHistory
from hvcpd.recognition.templates import FILLER_COST, Noise, Scorer, TemplateBank

# Thresholds that separate sentences from other sound. Costs are in units of the features' distance.
GAIN_STEP_DB = 6.0
"""Distance of the three template gains that are decoded side by side, around the level at the onset. Where the level is
farther from the middle one before a sentence they move to it."""
MOST_RISE_DB = 2.0 * GAIN_STEP_DB
"""Sound this much louder than the middle gain, a step louder than the highest, is heard again at its own level: in the
noise of a quiet room a path may be in progress by chance when somebody speaks."""
END_FRAMES = 25
"""Rest (250 ms) that ends a sentence: longer than the pause at a comma (150 ms)."""
LATE_END_FRAMES = 48
"""The same (480 ms) where the sentence could go on, since a pause at a comma and a first sound that is faint, or hidden
by noise, may last longer; and while a path inside a word is still cheaper."""
GOING_ON = 0.7
"""If the sentence could go on, it has not ended while a path through the next words is this much cheaper; of right
sentences in noise one in 25 of those that could go on has, of those cut short all but one in 12."""
LONGEST_PAUSE_FRAMES = 60
"""Longest pause within a sentence (0.6 s): nobody pauses longer at a comma, the weak sounds around it included. So the
same time before a sentence shows whether it follows silence."""
END_MARGIN = 5.0
"""Cost by which a path inside a word may be cheaper than a resting path that counts as the best: in noise alone, paths
through the next words gain a little by chance."""
UNDER_WAY = 16.0
"""Gain over the filler from which on a path may be a sentence in progress, and the least of a whole one. In noise alone
words gain 4 at most; in people's talk to each other, where words fit well, by 10 (18 minutes,
`benchmarks/rejection.py`)."""
SURE_GAIN = 56.0
"""Gain from which on it surely is one: twice what words that are fitted to a noise that has just risen gain."""
SURE_BLOCKS = 6
"""Number of blocks (48 frames) over which `DecoderSession.gain` is measured."""


@dataclass(frozen=True)
class SentenceWord:
    """A word of a path that ended, and how well it fits."""

    text: str
    step: TracedWord
    deficit: float
    """Mean distance per frame beyond the frame's best template, in units of FILLER_COST: near 0 for the right word, 1
    and above for anything else."""
    expected_gain: float
    """Gain over the filler if it was said (`Scorer.expected_gain`)."""
    duration_ratio: float
    """Its frames over those of the nearest take of the word."""


@dataclass(frozen=True)
class Sentence:
    """A path that ended. `pause`: the dearest pause inside it, in units of FILLER_COST times frames, which is the
    amount of speech that it skips."""

    words: tuple[SentenceWord, ...]
    voice: str
    cost: float
    pause: float


LEAST_MARGIN, MOST_MARGIN = 0.3, 12.0
"""Range of the cost of the closest other word that carries information."""
LEAST_FIT = 0.05
"""Least gain of a sentence, relative to the right one's, that carries information."""
MOST_WORD_FIT = 1.0
"""Most gain of a word, either way, that does; the quietest voices gain twice the right one's by chance."""
SLOW, SLOWEST = 1.4, 2.4
"""Range of a word's duration over its template's: right words have 1.25 at most, slow ones 1.4, insertions any."""
FAST = 0.9


@dataclass(frozen=True)
class ConfidenceFeatures:
    """Features that describe how well a sentence, or one word of it, fits.

    A word's gain over the filler says little by itself: near the noise level even the right word gains hardly anything.
    So the gain is divided by the gain expected of the right word in this noise (`Scorer.expected_gain`).
    """

    log_margin: float
    """Logarithm of the cost of the closest other word in the same place, for the word where that is least."""
    deficit: float
    """The words' mean `SentenceWord.deficit`."""
    worst: float
    """Deficit of the worst word: a word that nobody knows hides in a long sentence that is right otherwise."""
    log_gain: float
    """Logarithm of the sentence's gain over the filler: long sentences do not come about by chance."""
    log_fit: float
    """Logarithm of the sentence's gain, relative to the right sentence's."""
    word_fit: float
    """Gain of a word, relative to the right word's, where that is least."""
    slowness: float
    """Stretch of the slowest word, beyond SLOW: words matched to a steady sound last long."""
    haste: float
    """Stretch of the fastest word, below FAST."""

    @property
    def probability(self) -> float:
        """The probability, 0 to 1, that a hypothesis with these features is right: logistic regression, fitted by
        `python -m benchmarks.fit`."""
        return fitted_probability("sentence_confidence", astuple(self))


def confidence_features(sentence: Sentence, word: SentenceWord | None = None) -> ConfidenceFeatures:
    """Features of a sentence, or of one word of it."""
    words = sentence.words if word is None else (word,)
    gain = max(-sentence.cost, 1.0)
    margin = min(each.step.margin for each in words)
    deficits = [each.deficit for each in words]
    word_fit = min(-each.step.cost / each.expected_gain for each in words)
    duration_ratios = [each.duration_ratio for each in words]
    return ConfidenceFeatures(
        math.log(min(max(margin, LEAST_MARGIN), MOST_MARGIN)),
        sum(deficits) / len(deficits),
        max(deficits),
        math.log(gain),
        math.log(max(gain / sum(each.expected_gain for each in sentence.words), LEAST_FIT)),
        min(max(word_fit, -MOST_WORD_FIT), MOST_WORD_FIT),
        min(max(max(duration_ratios), SLOW), SLOWEST) - SLOW,
        max(FAST - min(duration_ratios), 0.0),
    )


class DecoderSession:
    """Feeds frames to scorer and decoder from `wake` until `sleep`."""

    def __init__(self, network: Network, bank: TemplateBank, beam: Beam) -> None:
        self._net, self._bank = network, bank
        gains_db = (-GAIN_STEP_DB, 0.0, GAIN_STEP_DB)
        self._scorer = Scorer(bank, gains_db)
        self._decoder = Decoder(network, len(gains_db), beam)
        self._first = self._next = 0
        """The first frame since the session woke, and the next one."""
        self._filler_excess, self._noise_cost = FrameHistory(), FrameHistory()
        self._bests: deque[float] = deque(maxlen=SURE_BLOCKS)
        self.awake = False
        self.best = BestPath(0.0)
        """The best path after the last frame."""

    @property
    def under_way(self) -> bool:
        """Whether some path may be a sentence in progress."""
        return self.best.cost < -UNDER_WAY

    @property
    def gain(self) -> float:
        """How much better than the filler a sentence in progress fits the last half second, in units of the templates'
        distance; 0 if none is."""
        known = self.under_way and len(self._bests) == SURE_BLOCKS
        return max(self._bests[0] - self._bests[-1], 0.0) if known else 0.0

    @property
    def surely_under_way(self) -> bool:
        """Whether a sentence surely is in progress, 0.1 to 0.3 s after its beginning."""
        return self.best.cost < -SURE_GAIN

    @property
    def ending_word(self) -> str:
        """The last word of the best path, if that may have ended just now, and may be reported soon; else ""."""
        return self._net.word[self._decoder.trace(self.best.token)[-1].instance] if self.best.node >= 0 else ""

    def wake(self, energies: Energies, first_frame: int, noise: Noise) -> None:
        """Begin with the frames, shape (n, N_BANDS), from `first_frame` on."""
        self.awake = True
        self._next = self._first = first_frame
        self._tail = np.repeat(energies[:1], CONTEXT_FRAMES, axis=0)
        self._decoder.reset(first_frame)
        self._bests.clear()
        self._gain = self._bank.level_of(energies, noise)
        self.feed(energies, energies, noise)

    def sleep(self) -> None:
        """Stop decoding; forget all paths."""
        if self.awake:
            self._scorer.free_memory()
        self.awake = False
        self.best = BestPath(0.0)

    def forget(self) -> None:
        """Drop all paths, for example after a rejected sentence; keep listening."""
        self._decoder.reset(self._next)
        self.best = BestPath(0.0)

    def feed(self, energies: Energies, recent: Energies, noise: Noise) -> None:
        """Decode the next frames; `recent`: the last ones with them, for the level, and to begin again with."""
        block = np.concatenate([self._tail, energies])
        if len(block) < 2 * CONTEXT_FRAMES + HORIZON_FRAMES:
            self._tail = block
            return
        self._tail = block[-2 * CONTEXT_FRAMES :]
        level = self._bank.level_of(recent, noise)
        if level > self._gain * power_ratio(MOST_RISE_DB):
            self.wake(recent, self._next + len(block) - CONTEXT_FRAMES - len(recent), noise)
            return
        self._retune(level)
        mask = self._bank.mask(self._gain)
        self._scorer.compose(noise + mask, self._gain)
        features = features_of(block + mask)
        for start in range(0, len(features), HORIZON_FRAMES):
            heard = features[start : start + HORIZON_FRAMES]
            active = self._decoder.prune()
            costs, noise_costs, excess = self._scorer.score(heard, active.row, active.hypothesis_begins)
            self._filler_excess.put(self._next, excess)
            self._noise_cost.put(self._next, noise_costs)
            for column, noise_cost in zip(costs, noise_costs.tolist(), strict=True):
                self._decoder.advance(column, noise_cost)
            self._next += len(heard)
        self._decoder.drop_long_pauses(LONGEST_PAUSE_FRAMES)
        self.best = self._decoder.best(END_MARGIN)
        self._bests.append(self.best.cost)

    def _retune(self, level: float) -> None:
        if level <= 0.0 or self.under_way:
            return
        if abs(decibels(level / max(self._gain, SILENT_POWER))) > GAIN_STEP_DB:
            self._gain = level

    def ended(self) -> Sentence | None:
        """The sentence that has just ended, if one has."""
        best = self.best
        if best.node < 0 or best.cost >= 0.0:
            return None
        may_go_on = bool(self._net.has_successors[best.node])
        if may_go_on and best.behind > GOING_ON:
            return None
        if best.rested_frames < (LATE_END_FRAMES if may_go_on or best.behind > 0.0 else END_FRAMES):
            return None
        steps = self._decoder.trace(best.token)
        pauses = (self._noise_cost.between(a.end_frame, b.start_frame) for a, b in pairwise(steps))
        pause = max((float(costs.sum()) for costs in pauses), default=0.0) / FILLER_COST
        words = tuple(map(self._scored, steps))
        return Sentence(words, self._net.voice_of_node(best.node), best.cost, pause)

    def _scored(self, step: TracedWord) -> SentenceWord:
        net, word, n_frames = self._net, step.instance, step.end_frame - step.start_frame
        excess = self._filler_excess.between(step.start_frame, step.end_frame)
        rows = net.first_row[word] + np.arange(net.length[word])
        # "I" has twice the length where it stands alone.
        nearest_take = np.clip(n_frames, net.word_shortest[word], net.word_longest[word])
        return SentenceWord(
            net.word[word],
            step,
            (step.cost + float(excess.sum())) / (n_frames * FILLER_COST),
            max(self._scorer.expected_gain(rows), 0.01) * n_frames,
            float(n_frames / nearest_take),
        )

    def lead_in(self, start_frame: int) -> float:
        """The mean cost of taking the 0.6 s before a sentence for noise, in units of FILLER_COST: 0 when it was
        noise, 1 and more for speech; 0 where the network slept."""
        begin = max(start_frame - LONGEST_PAUSE_FRAMES, self._first)
        costs = self._noise_cost.between(begin, start_frame - CONTEXT_FRAMES)
        return float(costs.mean()) / FILLER_COST if len(costs) else 0.0
