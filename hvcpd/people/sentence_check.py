"""Checks a robot's sentence by its phones: does the phone net hear them, too?

The channel search explains sound by robots' words through any response, and so finds words of theirs in anybody's talk;
the phone net knows the sounds of English and no robot. In loud noise it hears no phones, and has no say.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hvcpd.language.graph import graph_of
from hvcpd.people.bands import levelled, logs_of, noise_of
from hvcpd.people.phones import CtcSearch, Pronounce, centred, near_net
from hvcpd.ports import Samples

SPOKEN = 0.18
"""Mean probability of any phone in frames of clear speech, from which on the net is heard in full: in sentences of
robots it was 0.18 to 0.35, in a vacuum cleaner's noise at -7 dB 0.05 to 0.13."""


def loss_of_sentence(pronounce: Pronounce, words: Sequence[str], sound: Samples, noise: Samples) -> float:
    """The loss of these words' phones against the likeliest ones in a sound, shape (n,), nats per phone; less where the
    net hears hardly any. `noise`: the sound of the room alone, shape (m,)."""
    both, speech = levelled(np.concatenate([noise, sound]), sound)
    log_posteriors = near_net().output(centred(logs_of(speech, noise_of(both, len(noise))))).log_posteriors
    search = CtcSearch(graph_of(words), pronounce)
    fit = search.best(log_posteriors)
    if fit is None:
        return 0.0
    spoken = float(np.mean(1.0 - np.exp(log_posteriors[:, -1])))
    return min(spoken / SPOKEN, 1.0) * fit.loss / sum(map(search.n_phones, words))
