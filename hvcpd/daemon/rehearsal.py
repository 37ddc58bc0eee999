"""The robot's own words, made before it listens: making one takes milliseconds, and sound may not be late."""

from __future__ import annotations

import time
from collections.abc import Iterable

from hvcpd.assembly import Sound
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.speaker import PITCH_STEPS, UnitPosition


def rehearse(name: str, words: Iterable[str], sound: Sound) -> None:
    """Put every unit that the robot's voice can need into the cache; from then on a sentence only loads them. What no
    start has needed for long is deleted.

    Takes some seconds at the first start, and little at those after it. Without a cache it does nothing.
    """
    if sound.cache is None:
        return
    speaker = sound.speaker_of(name)
    for word in words:
        for position in UnitPosition:
            for pitch in PITCH_STEPS:
                for place in (None, *Place):
                    speaker.unit(word, position, pitch, place)
    sound.cache.tidy(time.time())
