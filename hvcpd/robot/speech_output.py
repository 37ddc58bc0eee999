"""Turns a robot's sentence into sound, and what it heard into a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hvcpd.coordination.actions import SECOND_PAUSE_S, Say
from hvcpd.errors import PhraseError
from hvcpd.language.messages import Cipher, Motion, Resume, Utterance
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.events import Event, Recognised
from hvcpd.synthesis.delivery import Delivery

CIPHER_PAUSE_S = 0.4
"""Longer than the rest that ends a sentence, 0.25 s, and shorter than the longest pause inside one, 0.6 s."""


class Mouth(Protocol):
    """The synthesizer, as the robot needs it; it renders sound of shape (n,), float32 at 16 kHz."""

    def render(self, phrases: Sequence[Sequence[str]]) -> Samples: ...


def delivered(mouth: Mouth, say: Say, book: Phrasebook) -> Samples:
    """Return the sound of a sentence as it is to be said, shape (n,), float32 at 16 kHz."""
    once, _ = Delivery(gain_db=say.level_db, lombard=say.for_noise).level(spoken(mouth, say.utterance, book))
    pause = np.zeros(samples_in(SECOND_PAUSE_S), np.float32)
    return np.concatenate([once] + [pause, once] * (say.times - 1))


def spoken(mouth: Mouth, utterance: Utterance, book: Phrasebook) -> Samples:
    """Return the sound of an utterance, said once and plainly, shape (n,), float32 at 16 kHz.

    A pause after "sealed message" lets listeners without a key understand that much.
    """
    phrases = book.phrases(utterance)
    if not isinstance(utterance.mark, Cipher):
        return mouth.render(phrases)
    pause = np.zeros(samples_in(CIPHER_PAUSE_S), np.float32)
    return np.concatenate([mouth.render(phrases[:-1]), pause, mouth.render(phrases[-1:])])


def meaning(event: Event, book: Phrasebook, may_be_cut: bool) -> Utterance | None:
    """What was said; None if it was not understood.

    "Resume" or a motion without a speaker's name may be the end of a longer sentence, such as "I have stopped until you
    say resume".
    """
    if not isinstance(event, Recognised):
        return None
    try:
        utterance = book.parse(event.words)
    except PhraseError:  # the network holds only sentences of the phrasebook; a foreign recogniser may not
        return None
    is_end = may_be_cut and utterance.speaker is None and isinstance(utterance.statement, Resume | Motion)
    return None if is_end else utterance
