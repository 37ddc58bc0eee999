"""What is left of the urgent word when the sentence around it is taken out."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.frontend import N_BANDS
from hvcpd.recognition.paths import Coherent, HeardWord
from hvcpd.recognition.remainder import Remainder
from hvcpd.recognition.stream import FrameStream
from hvcpd.recognition.urgent import UrgentSettings, UrgentSpotter, UrgentTemplates
from tests.recognition.signals import in_noise, sentence, word
from tests.recognition.way import Way

CALL = word("stop", 170.0)
TALK = sentence("rob water green rose, bot water green rose")
GAIN = 0.5
BEGIN = SAMPLE_RATE_HZ


def explains(said: Samples, call: Samples, at: int, late: int = 0) -> bool:
    """Whether a sentence explains the word that was heard `at` samples after its beginning; `late`: its place is so
    far off."""
    heard = np.float32(GAIN) * said
    heard[at : at + len(call)] += call[: len(heard) - at]
    start, end = BEGIN + at, BEGIN + at + len(CALL)
    remainder = Remainder(UrgentSpotter(UrgentTemplates({"low": [CALL]}, {}, frozenset({"stop"})), UrgentSettings()))
    kept = False
    for chunk in FrameStream().push(in_noise(heard), masked=False):
        remainder.hear(chunk)
        if not kept and chunk.first_frame * 160 > end:
            kept = True
            remainder.keep(start, end, np.full(N_BANDS, 1e-7, np.float32))
    begin = BEGIN + late
    words = (HeardWord("green", begin, begin + len(said), 1.0, 50.0, Way(said)),)
    remainder.understood([Coherent(words, "low", 500.0, gain=GAIN)])
    return remainder.explains(Recognised(("green",), "low", begin, begin + len(said), 1.0, 20.0, ()), start, end)


@pytest.mark.parametrize("at", [6_000, 14_000])
def test_a_call_over_a_sentence_is_still_there_without_it(at: int) -> None:
    assert not explains(TALK, np.float32(GAIN) * CALL, at)


def test_what_the_sentence_itself_made_up_is_gone_with_it() -> None:
    said = TALK.copy()
    said[6_000 : 6_000 + len(CALL)] += CALL
    assert explains(said, np.zeros(0, np.float32), 6_000)
    assert not explains(said, np.zeros(0, np.float32), 6_000, late=40), "not even its place was known"


def test_a_sentence_that_nobody_knows_explains_nothing() -> None:
    remainder = Remainder(UrgentSpotter(UrgentTemplates({"low": [CALL]}, {}, frozenset({"stop"})), UrgentSettings()))
    assert not remainder.explains(Recognised(("green",), "low", 0, 9_000, 1.0, 20.0, ()), 100, 8_000)
