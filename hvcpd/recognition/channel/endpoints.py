"""Endpointing for the channel search: where robots' sentences may begin, through any channel and in any noise; and the
segments of sound in which somebody seems to speak, and when they end.

Most sentences begin with a greeting, which in a robot's voice is a known signal. The whitened sound is correlated with
it, and the energy of the correlation in a window as long as a short response is compared with the median of all such
windows: a detector of constant false-alarm rate (M. Richards, "Fundamentals of Radar Signal Processing", 2nd ed.,
2014, chapter 7). It needs neither a channel estimate nor voice activity.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hvcpd.language.addressees import GREETING
from hvcpd.language.graph import WordGraph
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.recognition.arrays import quantile
from hvcpd.recognition.channel.estimation import FIRST_TAPS, MAX_SHIFT
from hvcpd.recognition.channel.path import Path, RenderedVoice, Rendering, sayable
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult, stretch_energies
from hvcpd.recognition.channel.whitening import (
    BAND_HZ,
    BINS,
    FRAME,
    interpolated,
    inverse_spectrum,
    moving_average,
    power_spectra,
)
from hvcpd.recognition.events import Garbled, Recognised
from hvcpd.recognition.frontend import TINY, rfft
from hvcpd.recognition.stages import QUIET

ONSET_WINDOW = 16 * FRAME
"""Samples of the transform, and of the sound that is searched at a time: 1.02 s."""
ONSET_STEP = samples_in(0.5)
"""Lags that are new each time."""
GREETING_LENGTH = ONSET_WINDOW - ONSET_STEP - FIRST_TAPS
"""Samples of a greeting that are correlated; a slow greeting is a little longer."""
LEAST_ONSET_RATIO = 6.5
"""Ratio of a window's energy to the median from which on it is the onset of a greeting. In four rooms and four kinds of
noise at -10 to 0 dB, 43 right ones had 6.7 to 178, and 300 half seconds of noise alone at most 6.5."""
RISE_FRAMES = 6
"""Frames (0.21 s) over which the rise over the noise is averaged."""
LEAST_RISE = 1.5
"""Mean weighted rise from which on a voice has begun. In steady noise at -10 dB, speech reaches 1.7 to 7.0 (72
sentences), and half seconds of noise alone 0.6 to 1.46 (250)."""
MEAN_RISE = 0.0489
"""Mean rise of a bin in steady noise, where its power over the mean is distributed exponentially and half of it
counts: the exponential integral E1(2)."""
TAPERED = 0.3
"""A bin counts at most as much as 1 / 0.3 mean ones, since the mean over a few bins is not steady."""
VOICED = slice(int(BAND_HZ[0] * FRAME / SAMPLE_RATE_HZ), FRAME // 4)
"""Bins (100 Hz to 4 kHz) in which voices have their harmonics."""


@dataclass(frozen=True)
class Onset:
    """A sentence may begin at sample `at` of the sound, with a `greeting`; otherwise it began before `at`."""

    at: int
    greeting: bool


class OnsetDetector:
    """Detects the first words of sentences in robots' voices."""

    def __init__(self, graph: WordGraph, books: Sequence[RenderedVoice]) -> None:
        firsts = [
            (book.voice, word, said)
            for book in books
            for word, node in graph.following[graph.start]
            for said in sayable(graph, book, word, 0, node)
        ]
        self._greetings: list[Rendering] = [said for _, word, said in firsts if word == GREETING]
        spectra = [np.conj(rfft(said.samples[:GREETING_LENGTH], ONSET_WINDOW)) for said in self._greetings]
        self._spectra = np.array(spectra, np.complex64)
        self._powers = np.square(np.abs(self._spectra))
        voices = {voice: np.zeros(BINS) for voice, _, _ in firsts}
        for voice, _, said in firsts:
            power = power_spectra(said.samples[:ONSET_WINDOW]).mean(axis=0)
            voices[voice] += power / max(float(power.sum()), TINY)
        self._voices = np.array(list(voices.values()), np.float32)

    def find(self, heard: Samples, noise: Samples) -> Onset | None:
        """The first onset in `heard`, shape (ONSET_WINDOW,): a greeting within the first ONSET_STEP samples, or else
        where a voice rises over the noise; None if there is none. `noise`: sound without speech, shape (n,), n ≥ FRAME.
        """
        return (self._greeting(heard, noise) or self._rise(heard, noise)) if self._greetings else None

    def _greeting(self, heard: Samples, noise: Samples) -> Onset | None:
        inverse = inverse_spectrum(heard, noise)
        there = interpolated(inverse, ONSET_WINDOW)
        received = np.asarray(rfft(heard, ONSET_WINDOW) * there, np.complex64)
        lags = np.fft.irfft(self._spectra * received, ONSET_WINDOW)[:, : ONSET_STEP + FIRST_TAPS]
        energies = stretch_energies(lags) / np.maximum(self._powers @ there, TINY)[:, None]
        number, block = divmod(int(energies.argmax()), energies.shape[1])
        if energies[number, block] < LEAST_ONSET_RATIO * max(quantile(energies, 0.5), TINY):
            return None
        return Onset(block * MAX_SHIFT + self._greetings[number].lead, greeting=True)

    def _rise(self, heard: Samples, noise: Samples) -> Onset | None:
        """The end of the first window in which the power rises over the noise in the bins of a voice.

        In steady noise the ratio of a bin's power to its mean is distributed exponentially. The logarithm of half that
        ratio, where it is positive, limits the influence of single bins. Bins are weighted by the ratio of the voice's
        power to the noise's, as in the optimum detector of a faint sound of known spectrum (H. Van Trees, "Detection,
        Estimation, and Modulation Theory", part III, 1971)."""
        usual = power_spectra(noise).mean(axis=0)
        usual = moving_average(usual, 2)[VOICED]
        usual += 1e-4 * usual.mean() + TINY
        rises = np.log(np.maximum(0.5 * power_spectra(heard)[:, VOICED] / usual, 1.0)) - MEAN_RISE
        above = self._voices[:, VOICED] / usual
        above /= np.maximum(above.mean(axis=1, keepdims=True), TINY)
        counts = above / (1.0 + TAPERED * above)
        counts /= np.maximum(np.linalg.norm(counts, axis=1, keepdims=True), TINY)
        total = np.cumsum(np.pad(rises @ counts.T, ((1, 0), (0, 0))), axis=0)
        risen = (total[RISE_FRAMES:] - total[:-RISE_FRAMES]).max(axis=1) > LEAST_RISE * RISE_FRAMES**0.5
        at = (int(risen.argmax()) + RISE_FRAMES) * FRAME // 2
        return Onset(at, greeting=False) if risen.any() else None


CLATTER = samples_in(8.0)
"""Time of signs of speech without QUIET among them, or since a greeting, from which on they count as clatter and no
longer show onsets and ends: a slow sentence takes 8 s or less, and is followed by quiet."""
SIGN_SHARE = 0.6
"""Share of the time with signs of speech from which on they show where a speaker ends: chosen between a voice that
stands out, and so has them nearly all the time, and one that noise hides. No other share was tried."""
SIGN_LAG = samples_in(0.6)
"""Longest time between the onset of a greeting and its first sign of speech."""
CUT_AFTER = samples_in(2.5)
"""Time after which a segment is cut whose end no sign of speech shows: otherwise the speaker would wait for an answer
until the clatter ends."""
CUT_AGAIN_AFTER = samples_in(1.25)
"""The same while a sentence was in progress at the last cut."""


@dataclass(eq=False)
class OpenSegment:
    """A segment from its first sign of speech to the last, and the first pass's events held for it; positions in
    samples."""

    begin: int
    end: int
    cut_at: int = sys.maxsize
    """The sample at which it is cut."""
    end_hidden: bool = False
    """Whether signs of speech do not show its end, since noise hides it or other sound goes on after it."""
    continues: bool = False
    """Whether a sentence was in progress at the end of the segment before."""
    first_sign: int = sys.maxsize
    sign_samples: int = 0
    """Number of samples with signs of speech, the first of which was `first_sign`."""
    greeted: bool = False
    """Whether a greeting was found in it."""
    held_events: list[Recognised | Garbled] = field(default_factory=list)
    closed_at: int = 0
    whole_from: int = 0
    """A sentence that begins before this sample may lack its beginning."""
    job: ChannelSegment | None = None
    result: SearchResult | None = None

    @property
    def shows_end(self) -> bool:
        """Whether there were signs of speech for most of the time, so that their end is the speaker's."""
        return self.sign_samples >= max(SIGN_SHARE * (self.end - self.first_sign), samples_in(0.5))

    @property
    def in_progress(self) -> tuple[Path, ...]:
        """The paths in progress at the segment's end, the best first."""
        return self.result.in_progress if self.result is not None else ()

    @property
    def first_start(self) -> int:
        """The sample at which the first of the paths in progress began. Raises ValueError if there is none."""
        return min(path.starts[0] for path in self.in_progress)

    def note_sign(self, at: int, now: int) -> None:
        """Note signs of speech from sample `at` up to `now`."""
        self.end = now
        self.sign_samples += now - at
        self.first_sign = min(self.first_sign, at)

    def note_onset(self, found: Onset, at: int, begin: int, since: int | None) -> None:
        """Note an onset at sample `at`, and not before `begin`; `since`: there have been signs of speech since this
        sample; None: there are none."""
        self.begin = min(self.begin, begin)
        self.greeted = self.greeted or found.greeting
        shown = since is not None and abs(since - at) <= SIGN_LAG
        if not self.continues:  # a sentence in progress is searched soon, whatever sounds like another greeting
            self.end_hidden, self.cut_at = not shown, at + (CLATTER if shown else CUT_AFTER)

    def is_over(self, now: int) -> bool:
        """Whether the speaker has surely ended."""
        return (not self.end_hidden or self.shows_end) and now - self.end >= QUIET
