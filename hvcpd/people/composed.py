"""Takes of words by their cepstra, as they would be in the noise of the moment (`recognition.templates`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hvcpd.people.matching import Heard, distances
from hvcpd.recognition.frontend import CONTEXT_FRAMES, Energies, features_of
from hvcpd.recognition.scorer import Scorer, norms_of
from hvcpd.recognition.templates import Noise, TemplateBank, noise_features

LEAST_GAIN = 1e-9


class ComposedTakes:
    """Knows takes of words in one or more voices."""

    def __init__(self, takes: Mapping[str, Mapping[str, Sequence[Energies]]]) -> None:
        """`takes[voice][word]`: without noise. Raises ValueError without takes."""
        self._bank = TemplateBank(takes)
        self._scorer = Scorer(self._bank, (0.0,))
        self.templates = self._bank.templates

    def hear(self, energies: Energies, noise: Noise) -> Heard:
        """A piece of sound, of whose noise the mean energies, shape (N_BANDS,), are known, beside the takes.

        `energies`, shape (n, N_BANDS), begin and end with a little noise.
        """
        gain = max(self._scorer.level_of(energies, noise), LEAST_GAIN)
        mask = self._scorer.mask(gain)
        rows = self._bank.compose(np.arange(self._bank.n_frames), noise + mask, gain)
        padded = np.pad(energies + mask, ((CONTEXT_FRAMES, CONTEXT_FRAMES), (0, 0)), mode="edge")
        heard = features_of(padded)
        silence = noise_features(noise + mask)[None, :]
        to_noise = distances(heard, silence, norms_of(silence))[:, 0]
        return Heard(heard, rows, to_noise)
