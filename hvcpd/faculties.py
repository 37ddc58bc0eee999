"""What a robot needs of its ears and its mouth, whoever makes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, Self

import numpy as np

from hvcpd.language.messages import Cipher, Utterance
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event as HearingEvent

CIPHER_PAUSE_S = 0.4
"""Longer than the rest that ends a sentence, 0.25 s, and shorter than what no speaker pauses inside one, 0.6 s."""


class Ears(Protocol):
    """The recogniser, as the robot needs it."""

    @property
    def busy(self) -> bool: ...

    def push(self, samples: Samples, masked: bool = False) -> list[HearingEvent]: ...

    def lost(self, n_samples: int) -> list[HearingEvent]: ...

    def succeed(self, predecessor: Self) -> None: ...

    def prepare(self, go_on: Callable[[], bool]) -> None: ...


class Overhears(Protocol):
    """`Overhearing`, as the robot needs it."""

    def begin(self, now: int, latency_s: float) -> None: ...

    def play(self, samples: Samples) -> None: ...

    def hear(self, samples: Samples, speaking: bool) -> Sequence[HearingEvent]: ...

    def lost(self) -> None: ...


class Mouth(Protocol):
    """The synthesizer, as the robot needs it."""

    def render(self, phrases: Sequence[Sequence[str]]) -> Samples: ...


def spoken(mouth: Mouth, utterance: Utterance, book: Phrasebook) -> Samples:
    """The sound of an utterance. After "sealed message" comes a pause in which who has no key understands so much."""
    phrases = book.phrases(utterance)
    if not isinstance(utterance.mark, Cipher):
        return mouth.render(phrases)
    pause = np.zeros(round(CIPHER_PAUSE_S * SAMPLE_RATE_HZ), np.float32)
    return np.concatenate([mouth.render(phrases[:-1]), pause, mouth.render(phrases[-1:])])
