"""What belongs to a measurement: the answer and the interval after the latest question, not those of an earlier one."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.language import messages as m
from hvcpd.language.range_messages import measured
from hvcpd.ports import Samples
from hvcpd.ranging.distance import Distance
from hvcpd.ranging.ranging import Ranging
from hvcpd.recognition.stream import History
from tests.ranging.test_arrival import LENGTH, VOICE

PAUSE = 8000


class Asker:
    """Rob, who hears every sentence at the sample where it is said; each takes as long as the voice."""

    def __init__(self) -> None:
        self._history, self._now = History(), 0
        self.ranging = Ranging("Rob", self._history)
        self.hear(np.zeros(PAUSE, np.float32))

    def asks(self) -> None:
        start = self.hear(VOICE, own=True)
        self.ranging.say(m.Utterance("Rob", m.ToRobot("Bot"), statement=m.HowFarAway()), VOICE, start)
        assert self.ranging.said(0.0) is None

    def hears(self, statement: m.Statement) -> Distance | None:
        start = self.hear(VOICE)
        said = m.Utterance("Bot", m.ToRobot("Rob"), statement=statement)
        return self.ranging.understood(said, start, lambda _: VOICE)

    def loses(self, n_samples: int) -> None:
        self._history.lose(n_samples)
        self._now += n_samples
        self.ranging.lost(self._now)

    def hear(self, sound: Samples, own: bool = False) -> int:
        """Its microphone hears a sound; returns the sample at which it began."""
        start, self._now = self._now, self._now + LENGTH + PAUSE
        noise = 1e-4 * np.random.default_rng(start).standard_normal(LENGTH + PAUSE)
        noise[: len(sound)] += sound
        self._history.push(np.asarray(noise, np.float32), masked=own)
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


def test_across_lost_sound_nothing_is_measured() -> None:
    rob = Asker()
    rob.asks()
    rob.loses(100)
    assert rob.hears(m.Measuring()) is None
    assert rob.hears(measured(interval(3.0))) is None


def test_a_sentence_that_follows_lost_sound_at_once_is_not_measured() -> None:
    """It may have arrived a little before where its beginning is sought."""
    rob = Asker()
    rob.loses(PAUSE)
    rob.asks()
    assert rob.hears(m.Measuring()) is None
    assert rob.hears(measured(interval(3.0))) is None
