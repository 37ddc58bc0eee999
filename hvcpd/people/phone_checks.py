"""Checks by the phone nets of what other listeners found: do they hear these phones, too?

The channel search explains sound by robots' words through any response, and so finds words of theirs in anybody's talk;
the phone nets know the sounds of English and no robot. Of the keyword's net they check each call. They know one voice
at a time: in a mixture of two they hear the phones of the louder one, so there they have no say about a call; nor have
they in noise nearly as loud as the word.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from hvcpd.language.graph import graph_of
from hvcpd.language.words import KEYWORD
from hvcpd.people.phones import FRAME_SAMPLES, CtcSearch, LogPosteriors, Pronounce, inputs_of, near_net, nets
from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.frontend import frame_powers
from hvcpd.recognition.keyword.stage import CHECKED_BEFORE

CLEARLY_SPOKEN = 0.18
"""Mean probability of any phone in frames of clear speech, from which on the net is heard in full: in sentences of
robots it was 0.18 to 0.35, in a vacuum cleaner's noise at -7 dB 0.05 to 0.13."""
VOWELS = ("AA", "AO", "AH")
"""The keyword's in several accents."""
BEFORE_FRAMES = samples_in(0.56) // FRAME_SAMPLES
"""First frames of the sound: they end 1 s before the word does, so that a name may come before it."""
EARLIEST_FRAME = samples_in(0.7) // FRAME_SAMPLES
"""The word begins 0.9 s before its assumed end at the earliest."""
END_FRAME = CHECKED_BEFORE // FRAME_SAMPLES
SPEECH_BEFORE = 0.1
"""Mean probability of any phone from which on somebody speaks before the word."""
LOUD_FRAMES = 10
LEAST_LOUD_RATIO = 4.0
"""Least power (6 dB) of the word's loudest 0.2 s over what is heard before it. In pink noise as loud as people's calls
the phone net misheard 6 of 37."""
MOST_CALL_LOSS = 1.5
"""A phone net may be wrong, too: a certain call (0.97) stays one whatever that hears. On the part `validate` 12 of 681
calls lose their stop for good; a fitted curve takes 1.6 at most (docs/decisions/keyword.md)."""


def loss_of_sentence(pronounce: Pronounce, words: Sequence[str], sound: Samples, noise: Samples) -> float:
    """The loss of these words' phones against the likeliest ones in a sound, shape (n,), nats per phone; less where the
    net hears hardly any. `noise`: the sound of the room alone, shape (m,)."""
    log_posteriors = near_net().log_posteriors(inputs_of(sound, np.concatenate([noise, sound]), len(noise)))
    search = CtcSearch(graph_of(words), pronounce)
    fit = search.best(log_posteriors)
    if fit is None:
        return 0.0
    spoken = float(np.mean(1.0 - np.exp(log_posteriors[:, -1])))
    return min(spoken / CLEARLY_SPOKEN, 1.0) * fit.loss / sum(map(search.n_phones, words))


def loss_of_call(sound: Samples) -> float:
    """What the phone nets take from the log odds of a call, nats, 0 to MOST_CALL_LOSS: the mean loss of the keyword
    against the likeliest phones, in a sound that begins CHECKED_BEFORE before the word's end; 0 if somebody speaks
    before it, who may go on, or in noise. Who speaks after it may be the same person: "Bot, come back" begins like a
    call."""
    if not _stands_out(sound):
        return 0.0
    logs = inputs_of(sound, sound, 0)
    readings = [net.log_posteriors(logs) for net in nets()]
    if not all(map(_is_quiet_before, readings)):
        return 0.0
    return min(sum(map(_loss, readings)) / len(readings), MOST_CALL_LOSS)


def _loss(log_posteriors: LogPosteriors) -> float:
    """Of the keyword's phones."""
    word = log_posteriors[EARLIEST_FRAME:].copy()
    word[:, -1] = word.max(axis=1)  # other phones beside the keyword's cost nothing
    fit = _search().best(word)
    return fit.loss if fit is not None else 0.0


def _is_quiet_before(log_posteriors: LogPosteriors) -> bool:
    """Whether nobody speaks before the word."""
    spoken = 1.0 - np.exp(log_posteriors[:BEFORE_FRAMES, -1])
    return bool(spoken.mean() < SPEECH_BEFORE)


def _stands_out(sound: Samples) -> bool:
    """Whether the word is loud beside the sound before it."""
    powers = frame_powers(sound, FRAME_SAMPLES)
    loud = np.sort(powers[EARLIEST_FRAME:END_FRAME])[-LOUD_FRAMES:]
    return len(loud) > 0 and bool(loud.mean() >= LEAST_LOUD_RATIO * powers[:BEFORE_FRAMES].mean())


@cache
def _search() -> CtcSearch:
    return CtcSearch(graph_of((KEYWORD,)), lambda _word: [("S", "T", vowel, "P") for vowel in VOWELS])
