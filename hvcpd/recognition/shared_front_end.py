"""The front end that all recognisers on one microphone share: frames, history, noise estimate and voice activity.

While only noise is heard this is all that runs; the decoders sleep. Voice activity is energy above the noise estimate,
in any part of the spectrum: the log ratio of each band's energy to the noise, averaged over a short window and over
groups of bands; the highest group counts. Since logarithms are averaged, the same thresholds hold in any noise at any
level.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples
from hvcpd.recognition.events import Garbled
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, SILENT_POWER, Energies, decibels, power_weights
from hvcpd.recognition.noise import STEADY_MEAN_LOG, NoiseTracker
from hvcpd.recognition.stream import CHUNK_FRAMES, Chunk, FrameHistory, FrameStream, History

FAST_FRAMES = 8
"""80 ms: short enough to hear an onset in time for listen-before-talk."""
SLOW_FRAMES = 16
"""160 ms, about a syllable: for speech too weak for the fast window."""
LONG_FRAMES = 48
"""480 ms, about a short word: for speech below the noise. The network is woken with what was heard since."""
LEAST_LOG_RATIO, MOST_LOG_RATIO = np.float32(-1.0), np.float32(3.0)
"""Natural log of a band's energy over the noise, clipped (-4 to 13 dB): one loud band does not decide alone."""
N_GROUPS = 3
"""Low, middle and high bands are evaluated separately, and all together."""
ONSET, RELEASE = 0.8, 0.45
"""Mean log ratio to steady noise from which somebody speaks, 5 standard deviations of the fast window there; and below
which nobody does any more, after RELEASE_FRAMES."""
RELEASE_FRAMES = 16
"""160 ms, which bridge the closures of stop consonants and the commas' pauses."""
ALERT, LONG_ALERT = 0.3, 0.18
"""Thresholds of the slow and the long window that wake the network: the most in 5 minutes of steady noise."""
MIN_SPEECH_FRAMES = 30
"""0.3 s: shorter sounds are knocks and clicks."""
MIN_MODULATION = 0.35
"""Standard deviation over time of the mean log energy, natural log: steady noise has 0.1, speech 0.7 and more."""
WAIT_FRAMES = 12
"""0.12 s of quiet, after RELEASE_FRAMES, before speech without a sentence is given up and searched for people's. With
0.3 s a stranger was answered 0.17 s later, and robots were heard no better and no worse (docs/decisions/phones.md)."""
LONGER_WAIT_FRAMES = 110
"""The same while a sentence seems to be under way (1.1 s): its faint end may still come (a final n in noise)."""


class VoiceActivityDetector:
    """Voice activity detection, chunk by chunk; `busy` and `possible_speech` describe the most recent frames."""

    def __init__(self) -> None:
        groups = np.kron(np.eye(N_GROUPS), np.full((N_BANDS // N_GROUPS, 1), N_GROUPS / N_BANDS))
        self._groups = np.hstack([groups, np.full((N_BANDS, 1), 1.0 / N_BANDS)]).astype(np.float32)
        """Weights of the bands in the means over each group, and over all bands, shape (N_BANDS, N_GROUPS + 1)."""
        lengths = np.array([[FAST_FRAMES], [SLOW_FRAMES], [LONG_FRAMES]])
        self._windows = ((np.arange(LONG_FRAMES) >= LONG_FRAMES - lengths) / lengths).astype(np.float32)
        """Weights of the history's frames in the means over the last of them, shape (3, LONG_FRAMES)."""
        self._history = np.zeros((LONG_FRAMES, N_GROUPS + 1), np.float32)
        self._quiet_frames = 0
        self.busy = False
        """Somebody else is speaking."""
        self.possible_speech = False
        """Something may be speech; more easily true than `busy`."""

    def push(self, energies: Energies, noise: NDArray[np.float32]) -> None:
        """Take the next frames, shape (n, N_BANDS), n at most FAST_FRAMES, and the noise estimate (N_BANDS,)."""
        n = len(energies)
        ratio = np.log(energies / noise) - STEADY_MEAN_LOG
        np.minimum(np.maximum(ratio, LEAST_LOG_RATIO, out=ratio), MOST_LOG_RATIO, out=ratio)
        self._history[:-n] = self._history[n:].copy()
        self._history[-n:] = ratio @ self._groups
        fast, slow, long = np.maximum.reduce(self._windows @ self._history, axis=1).tolist()
        self.possible_speech = slow > ALERT or fast > ONSET or long > LONG_ALERT
        if fast > ONSET:
            self.busy = True
        self._quiet_frames = 0 if fast > RELEASE else self._quiet_frames + n
        if self._quiet_frames >= RELEASE_FRAMES:
            self.busy = False

    def account_for(self, n_after: int) -> None:
        """Forget all but the last `n_after` frames, which a sentence explains. Ongoing speech will trigger it again."""
        self._history[: max(LONG_FRAMES - n_after, 0)] = 0.0

    def reset(self) -> None:
        """Start again in silence, for example after the robot's own words."""
        self._history.fill(0.0)
        self.busy = False
        self.possible_speech = False


class Segmenter:
    """Segments speech by voice activity and the modulation of its level; segments without a sentence are garbled."""

    def __init__(self) -> None:
        self._start: int | None = None
        self._end = 0
        self._loudness: list[float] = []
        """Mean log energy of each frame."""

    def push(self, first_frame: int, energies: Energies, busy: bool) -> None:
        """Take the next frames, shape (n, N_BANDS), and whether somebody speaks in them."""
        if not busy:
            return
        if self._start is None:
            self._start, self._loudness = first_frame, []
        self._end = first_frame + len(energies)
        self._loudness += np.log(energies).mean(axis=1).tolist()

    def ended(self, frame: int, under_way: bool) -> Garbled | None:
        """The speech that ended long enough before `frame`; anything else that ended is forgotten.

        `under_way`: the recogniser may still make a sentence of it.
        """
        wait = LONGER_WAIT_FRAMES if under_way else WAIT_FRAMES
        return self.close(self._end) if frame - self._end >= wait else None

    def close(self, frame: int) -> Garbled | None:
        """End the current segment at `frame` at the latest; return it if it was speech."""
        if self._start is None:
            return None
        start, end = self._start, min(self._end, frame)
        self._start = None
        speech_like = np.std(self._loudness) >= MIN_MODULATION
        lasted = end - start >= MIN_SPEECH_FRAMES
        return Garbled(start * HOP_SAMPLES, end * HOP_SAMPLES) if speech_like and lasted else None


RECENT_FRAMES = 160
"""1.6 s of frames are kept to be replayed into a network when it wakes."""
LEAST_SNR = 1e-3
"""Ratio of powers (-30 dB) below which a signal-to-noise ratio says no more."""


class SharedFrontEnd:
    """Cuts the sound of one microphone into chunks, and follows its noise and activity."""

    def __init__(self) -> None:
        self.stream = FrameStream()
        self.history = History()
        self.noise = NoiseTracker()
        self.activity = VoiceActivityDetector()
        self.recent: Energies = np.zeros((0, N_BANDS), np.float32)
        """The last frames, shape (n, N_BANDS), n at most RECENT_FRAMES; none from before a break."""
        self._before_noise_estimate: list[Chunk] = []
        """The chunks from before the first noise estimate."""
        self._power_weights = power_weights()
        self._powers, self._noise_powers = FrameHistory(), FrameHistory()

    def push(self, samples: Samples, masked: bool) -> Iterator[Chunk]:
        """Keep the next samples, shape (n,); yield the chunks that they complete. Iterate to the end, or samples are
        lost."""
        samples = np.asarray(samples).reshape(-1)
        self.history.push(samples, masked)
        return self.stream.push(samples, masked)

    def lose(self, n_samples: int) -> Iterator[Chunk]:
        """Advance time by lost samples; likewise. Raises ValueError for a negative number."""
        if n_samples < 0:
            raise ValueError(f"{n_samples} samples cannot be lost")
        self.history.lose(n_samples)
        return self.stream.lose(n_samples)

    def silence(self, frame: int, n_chunks: int) -> list[Chunk]:
        """Chunks of the room's noise from a frame on, after the end of the sound."""
        energies = np.tile(self.noise.estimate * np.exp(STEADY_MEAN_LOG), (CHUNK_FRAMES, 1))
        return [Chunk(at, energies, False) for at in range(frame, frame + n_chunks * CHUNK_FRAMES, CHUNK_FRAMES)]

    def analysed(self, chunk: Chunk) -> Iterator[Chunk]:
        """Yield the chunk once its activity is known: none before the noise is, then all since. Iterate to the end."""
        self.recent = np.concatenate([self.recent, chunk.energies])[-RECENT_FRAMES:]
        self._before_noise_estimate.append(chunk)
        if not self.noise.ready:
            return
        for each in self._before_noise_estimate:
            self.activity.push(each.energies, self.noise.estimate)
            power = each.energies @ self._power_weights
            self._powers.put(each.first_frame, power)
            self._noise_powers.put(each.first_frame, np.full_like(power, self.noise.estimate @ self._power_weights))
            yield each
        self._before_noise_estimate = []

    def reset(self) -> None:
        """Start again in silence."""
        self.activity.reset()
        self.recent = self.recent[:0]

    def snr_db(self, start_sample: int, end_sample: int) -> float:
        """Mean level of what was heard between two samples, a frame or more apart, without the noise, over the tracked
        noise, dB."""
        start, end = start_sample // HOP_SAMPLES, end_sample // HOP_SAMPLES
        noise = float(self._noise_powers.between(start, end).mean())
        speech = float(self._powers.between(start, end).mean()) - noise
        return decibels(max(speech / max(noise, SILENT_POWER), LEAST_SNR))
