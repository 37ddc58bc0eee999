"""A sentence that the waveform suggests must explain what was heard above the noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import pytest

from hvcpd.ports import Samples
from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.paths import Coherent, HeardWord
from hvcpd.recognition.recogniser import Recogniser
from tests.recognition.signals import graph, in_noise, sentence, templates

BEGIN, END = 17_000, 33_000


@dataclass
class Suggests:
    """Hears one and the same sentence when its end was heard."""

    sentence: Coherent
    listens = True
    follows = None

    def push(self, first: int, samples: Samples, _speech: bool) -> list[Coherent]:
        return [self.sentence] if first < END + 3_200 <= first + len(samples) else []

    def dismiss(self, end: int, voice: str | None = None) -> None:
        pass


GREETED = (HeardWord("hi", BEGIN, 22_000, 1.0, 50.0), HeardWord("rob", 24_000, END, 1.0, 50.0))
CALL = (HeardWord("stop", BEGIN, END, 1.0, 50.0),)


def is_reported(words: tuple[HeardWord, ...], explained: float, score: float, noise_dbfs: float) -> bool:
    """Whether a sentence is that explains so much of other talk."""
    listener = Suggests(Coherent(words, "low", score, explained))
    ears = Recogniser(graph(), templates(), coherent=cast(CoherentListener, listener))
    sound = in_noise(sentence("water green rose, water green rose"), noise_dbfs=noise_dbfs)
    events = [event for at in range(0, len(sound), 400) for event in ears.push(sound[at : at + 400])]
    said = tuple(word.word for word in words)
    return any(isinstance(event, Recognised) and event.words == said for event in events)


@pytest.mark.parametrize(
    ("explained", "score", "noise_dbfs", "expected"),
    [(0.06, 200.0, -60.0, False), (0.06, 400.0, -60.0, True), (0.3, 200.0, -60.0, True), (0.03, 200.0, -5.0, True)],
)
def test_in_quiet_most_must_be_explained_and_below_the_noise_little(
    explained: float, score: float, noise_dbfs: float, expected: bool
) -> None:
    assert is_reported(GREETED, explained, score, noise_dbfs) is expected


@pytest.mark.parametrize(
    ("explained", "score", "noise_dbfs", "expected"),
    [(0.06, 4000.0, -60.0, False), (0.3, 400.0, -60.0, True), (0.03, 400.0, -5.0, True)],
)
def test_no_score_makes_a_call_of_a_small_part_of_another_sentence(
    explained: float, score: float, noise_dbfs: float, expected: bool
) -> None:
    assert is_reported(CALL, explained, score, noise_dbfs) is expected
