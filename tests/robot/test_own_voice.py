"""When the own voice ends in the own microphone, by what is told of its delay and by what is measured."""

from __future__ import annotations

import weakref

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.robot.own_voice import ECHO_S, Acoustics, OwnVoice

BLOCK = 400
BLOCK_S = BLOCK / SAMPLE_RATE_HZ
SPEECH = np.full(2 * SAMPLE_RATE_HZ, 0.5, np.float32)
SPEECH_S = 2.0
WORDS = ("hi", "all", "i", "am", "rob")
TAIL_S = 0.12


class Delay:
    """Has measured what the test says."""

    def __init__(self, *measured_s: float | None) -> None:
        self.coming = list(measured_s)
        self.played = 0
        self.heard = 0
        self.aligned = True

    def begin(self) -> None:
        self.played = self.heard = 0

    def play(self, samples: Samples) -> None:
        self.aligned &= self.heard == self.played  # what is played next is over the block that is heard next
        self.played += len(samples)

    def hear(self, samples: Samples) -> None:
        self.heard += len(samples)

    def measure(self) -> float | None:
        return self.coming.pop(0)


class Life:
    """An own voice, block by block, as the robot has it."""

    def __init__(self, told_s: float, delay: Delay) -> None:
        self.voice = OwnVoice(Acoustics(told_s, TAIL_S), delay)
        self.n = 0
        self.played: list[Samples] = []

    @property
    def now(self) -> float:
        return self.n / SAMPLE_RATE_HZ

    def block(self, begins: bool = False) -> bool:
        finished = self.voice.finished(self.now)
        self.voice.hear(np.zeros(BLOCK, np.float32))
        self.n += BLOCK
        if begins:
            self.voice.begin(SPEECH, WORDS, self.now)
        self.played.append(self.voice.take(BLOCK))
        return finished

    def sentence(self) -> tuple[float, float]:
        """Say one; how long after what was handed out the own voice counted as ended, and was no longer masked."""
        self.block(begins=True)
        begun_s = self.now
        while not self.block():
            assert self.now < begun_s + 10.0
        ended_s = self.now - BLOCK_S - begun_s - SPEECH_S
        while self.voice.masks(self.now):
            self.block()
        return ended_s, self.now - begun_s - SPEECH_S


@pytest.mark.parametrize("latency_s", [0.0, 0.075, 0.225, 0.6])
def test_without_a_measurement_what_is_told_holds(latency_s: float) -> None:
    life = Life(latency_s, Delay(None))
    ended_s, unmasked_s = life.sentence()
    assert ended_s == pytest.approx(latency_s, abs=BLOCK_S)
    assert unmasked_s == pytest.approx(latency_s + TAIL_S, abs=2 * BLOCK_S)
    np.testing.assert_array_equal(np.concatenate(life.played)[: len(SPEECH)], SPEECH)


@pytest.mark.parametrize("true_s", [0.225, 0.6])
def test_a_longer_delay_holds_for_the_very_sentence(true_s: float) -> None:
    delay = Delay(true_s, true_s)
    life = Life(0.15, delay)
    for _ in range(2):
        ended_s, _ = life.sentence()
        assert ended_s == pytest.approx(true_s, abs=BLOCK_S)
    assert delay.aligned
    assert life.voice.latency_s == true_s


def test_a_shorter_delay_holds_once_it_was_seen_twice_in_a_row() -> None:
    life = Life(0.15, Delay(0.075, 0.03, 0.075, 0.078, 0.078))
    ends = [life.sentence()[0] for _ in range(5)]
    assert ends[:4] == pytest.approx([0.15] * 4, abs=BLOCK_S)
    assert ends[4] == pytest.approx(0.078, abs=BLOCK_S)


def test_where_no_echo_is_found_what_was_measured_before_holds() -> None:
    life = Life(0.15, Delay(0.6, None, None))
    assert [life.sentence()[0] for _ in range(3)] == pytest.approx([0.6] * 3, abs=BLOCK_S)


def test_the_delay_changes_in_mid_mission() -> None:
    life = Life(0.15, Delay(0.225, 0.6, 0.6, 0.225, 0.225, 0.225))
    ends = [life.sentence()[0] for _ in range(6)]
    assert ends == pytest.approx([0.225, 0.6, 0.6, 0.6, 0.6, 0.225], abs=BLOCK_S)


def test_what_was_measured_beyond_what_was_told_stays_when_the_card_tells_anew() -> None:
    life = Life(0.15, Delay(0.25, None))
    life.sentence()
    life.voice.report_latency(0.15)
    assert life.voice.latency_s == 0.25
    life.voice.report_latency(0.20)
    assert life.voice.latency_s == pytest.approx(0.30)
    assert life.sentence()[0] == pytest.approx(0.30, abs=BLOCK_S)


def test_a_card_that_tells_anew_within_a_sentence_moves_its_end() -> None:
    life = Life(0.15, Delay())
    life.block(begins=True)
    until_s = life.voice.until_s
    life.voice.report_latency(0.4)
    assert life.voice.until_s == pytest.approx(until_s + 0.25)


@given(st.lists(st.floats(0.0, 5.0), max_size=20))
def test_no_word_of_the_card_makes_the_latency_negative(told: list[float]) -> None:
    voice = OwnVoice(Acoustics(0.0), Delay())
    for told_s in told:
        voice.report_latency(told_s)
        assert voice.latency_s >= 0.0


def test_sound_that_was_lost_delays_the_end_and_is_not_measured() -> None:
    life = Life(0.15, Delay())
    life.block(begins=True)
    until_s = life.voice.until_s
    life.voice.lose(0.5)
    assert life.voice.until_s == pytest.approx(until_s + 0.5)
    while not life.block():
        assert life.now < 10.0


def test_the_own_words_that_come_back_are_known() -> None:
    voice = OwnVoice(Acoustics(0.15), Delay())
    voice.begin(SPEECH, WORDS, 10.0)
    end_s = voice.until_s
    assert voice.returns(WORDS, end_s + 0.6)
    assert voice.returns(WORDS[2:], end_s + 0.3), "the first of them were masked"
    assert not voice.returns(WORDS[:3], end_s + 0.3), "an echo ends as the sentence does"
    assert not voice.returns(("hi", "all", "i", "am", "bot"), end_s + 0.3)
    assert not voice.returns((), end_s + 0.3)
    assert not voice.returns(WORDS, end_s + ECHO_S + 0.1), "too late"
    assert not voice.returns(WORDS, end_s - 0.1), "too soon"


def test_before_the_first_sentence_nothing_comes_back() -> None:
    assert not OwnVoice(Acoustics(), Delay()).returns(WORDS, 1.0)


def test_the_latency_counts_as_known_once_a_sentence_came_back_in_time() -> None:
    life = Life(0.15, Delay(0.6, None, 0.3, 0.3, 0.3))
    assert not life.voice.is_latency_known
    seen = []
    for _ in range(5):
        life.sentence()
        seen.append(life.voice.is_latency_known)
    assert seen == [True, True, False, True, True], "what is not found changes nothing, what is sooner once is in doubt"


def test_what_loses_sound_puts_the_latency_in_doubt() -> None:
    for doubt in (
        lambda voice: voice.lose(0.1),
        lambda voice: voice.break_off(1.0),
        lambda voice: voice.report_latency(0.2),
    ):
        life = Life(0.15, Delay(0.15))
        life.sentence()
        assert life.voice.is_latency_known
        doubt(life.voice)
        assert not life.voice.is_latency_known


@pytest.mark.parametrize(("after_s", "silent_s"), [(0.0, 0.2), (BLOCK_S, 0.2 - BLOCK_S), (0.5, 0.0)])
def test_what_follows_a_sentence_that_is_broken_off_does_not_begin_in_its_last_word(
    after_s: float, silent_s: float
) -> None:
    """Another robot took "stop" for a part of that word."""
    voice = OwnVoice(Acoustics(0.0), Delay(0.0))  # type: ignore[arg-type]
    voice.begin(SPEECH, WORDS, 0.0)
    voice.take(BLOCK)
    voice.break_off(1.0)
    voice.begin(SPEECH, ("stop",), 1.0 + after_s)
    n_silent = round(silent_s * SAMPLE_RATE_HZ)
    assert list(np.flatnonzero(voice.take(n_silent + 1))) == [n_silent]
    assert voice.until_s == pytest.approx(1.0 + after_s + silent_s + SPEECH_S)


def test_a_sentence_that_was_said_takes_no_memory() -> None:
    speech = SPEECH.copy()
    kept = weakref.ref(speech)
    voice = OwnVoice(Acoustics(0.0), Delay(0.0))  # type: ignore[arg-type]
    voice.begin(speech, WORDS, 0.0)
    del speech
    voice.take(2 * SAMPLE_RATE_HZ)
    assert voice.finished(3.0)
    assert kept() is None
