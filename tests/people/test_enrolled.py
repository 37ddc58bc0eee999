"""A person's words, as they are kept and as templates."""

from __future__ import annotations

import numpy as np

from hvcpd.people.enrolled import MAX_TAKES, Person, spoken_takes
from hvcpd.recognition.frontend import N_BANDS


def take(seed: int, frames: int = 40) -> np.ndarray:
    return np.exp(np.random.default_rng(seed).normal(-6.0, 2.0, (frames, N_BANDS))).astype(np.float32)


ANNA = Person("Anna", {"stop": [take(1), take(2)], "hi": [take(3, 30)]})


def test_only_the_newest_takes_are_kept() -> None:
    person = ANNA.with_takes({"stop": [take(k, 20 + k) for k in range(MAX_TAKES)], "all": [take(9)]})
    assert [len(t) for t in person.takes["stop"]] == [20 + k for k in range(MAX_TAKES)]
    assert person.takes.keys() == {"stop", "hi", "all"}


def test_templates_are_as_loud_as_one_another() -> None:
    quiet = Person("Anna", {"stop": [take(1) * np.float32(1e-4)], "will": [take(3)]})
    found = spoken_takes(quiet, ["stop", "will", "water"])
    assert sorted(found) == ["stop", "will"]
    assert [len(t) for of_word in found.values() for t in of_word] == [40, 40]
    loudness = [float(np.median(t.sum(axis=1))) for t in (found["stop"][0], found["will"][0])]
    assert 0.2 < loudness[0] / loudness[1] < 5.0


def test_templates_come_in_the_order_of_their_words_whatever_the_order_of_a_set() -> None:
    words = [f"word{k}" for k in range(20)]
    assert list(spoken_takes(Person("Anna", {word: [take(1)] for word in reversed(words)}), words)) == words
