"""What belongs to a measurement: the answer and the interval after the latest question, not those of an earlier one."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.language import messages as m
from hvcpd.language.range_messages import measured
from hvcpd.ports import Samples
from hvcpd.ranging.distance import Distance
from hvcpd.ranging.ranging import Ranging
from tests.ranging.test_arrival import LENGTH, VOICE

PAUSE = 8000


class Asker:
    """Rob, who hears every sentence at the sample where it is said; each takes as long as the voice."""

    def __init__(self) -> None:
        self.ranging = Ranging("Rob")
        self._now = 0
        self._hear(np.zeros(PAUSE, np.float32))

    def asks(self) -> None:
        start = self._hear(VOICE)
        self.ranging.say(m.Utterance("Rob", m.ToRobot("Bot"), statement=m.HowFarAway()), VOICE, start)
        assert self.ranging.said(0.0) is None

    def hears(self, statement: m.Statement) -> Distance | None:
        start = self._hear(VOICE)
        said = m.Utterance("Bot", m.ToRobot("Rob"), statement=statement)
        return self.ranging.understood(said, start, lambda _: VOICE)

    def _hear(self, sound: Samples) -> int:
        start, self._now = self._now, self._now + LENGTH + PAUSE
        noise = 1e-4 * np.random.default_rng(start).standard_normal(LENGTH + PAUSE)
        noise[: len(sound)] += sound
        self.ranging.hear(np.asarray(noise, np.float32), start)
        return start


def interval(distance_m: float) -> int:
    there_and_back = 2.0 * distance_m / 343.0 * 16_000
    return round(LENGTH + PAUSE - there_and_back) % 10_000


def test_question_answer_and_interval_make_a_distance() -> None:
    rob = Asker()
    rob.asks()
    assert rob.hears(m.Measuring()) is None
    found = rob.hears(measured(interval(3.0)))
    assert found is not None
    assert found.distance_m == pytest.approx(3.05, abs=0.02)  # half the way to its own microphone is added


def test_an_interval_after_a_new_question_is_not_taken_for_the_earlier_one() -> None:
    rob = Asker()
    rob.asks()
    assert rob.hears(m.Measuring()) is None  # and its interval is lost
    rob.asks()
    assert rob.hears(measured(interval(3.0))) is None


def test_who_cannot_measure_tells_no_interval_later() -> None:
    rob = Asker()
    rob.asks()
    assert rob.hears(m.Measuring()) is None
    assert rob.hears(m.CannotMeasure()) is None
    assert rob.hears(measured(interval(3.0))) is None
