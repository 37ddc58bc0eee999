"""The robot's own voice is taken out of what it hears, and "stop" over it is heard."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from hvcpd.assembly.make import make_barge_in_detector
from hvcpd.assembly.sound import Sound, make_sound, user_cache_folder
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.barge_in import BLOCK, MEMORY, BargeInDetector, EchoCanceller
from hvcpd.recognition.events import Held, KeywordEvent, Released, Urgent
from hvcpd.recognition.keyword.verification import HOLD_TIME

RT60_S = 0.45
SENTENCE = [["hi", "all"], ["i", "am", "rob"], ["task", "three", "complete"], ["i", "will", "complete", "task", "one"]]


@cache
def sound() -> Sound:
    return make_sound(None, user_cache_folder())


ORANGE = [["hi", "all"], ["i", "am", "bot"], ["completing", "task"], ["water", "the", "orange", "rose"]]


@cache
def own_voice(name: str = "Rob", orange: bool = False) -> Samples:
    """Two sentences with a second of silence after each."""
    said = sound().speaker_of(name).render(ORANGE if orange else SENTENCE)
    rest = np.zeros(SAMPLE_RATE_HZ, np.float32)
    once = np.concatenate([0.2 * said / np.sqrt(np.mean(np.square(said))), rest])
    both = np.concatenate([once, once]).astype(np.float32)
    return both[: len(both) // BLOCK * BLOCK]


def through_room(played: Samples, late_ms: float, seed: int) -> Samples:
    """As the microphone beside the loudspeaker hears it: late, ringing, with a little noise."""
    rng = np.random.default_rng(seed)
    n = round(RT60_S * SAMPLE_RATE_HZ)
    ringing = 0.006 * rng.standard_normal(n) * 10.0 ** (-3.0 * np.arange(n) / n)
    ringing[0] = 1.0
    way = np.concatenate([np.zeros(round(late_ms / 1000.0 * SAMPLE_RATE_HZ)), ringing])
    size = len(played) + len(way)
    heard = np.fft.irfft(np.fft.rfft(played, size) * np.fft.rfft(way, size), size)[: len(played)]
    return np.asarray(0.5 * heard + 1e-4 * rng.standard_normal(len(heard)), np.float32)


def level_db(samples: Samples) -> float:
    return float(10.0 * np.log10(np.mean(np.square(samples))))


@pytest.mark.parametrize("late_ms", [0.3, 20.0, 40.0])
def test_little_is_left_of_the_own_voice_however_late_it_is_heard(late_ms: float) -> None:
    heard = through_room(own_voice(), late_ms, 1)
    rest = EchoCanceller().take(own_voice(), heard)
    second = slice(len(heard) // 2, len(heard))
    assert level_db(rest[second]) < level_db(heard[second]) - 18.0


def test_what_somebody_else_says_is_left_as_it_is() -> None:
    heard = through_room(own_voice(), 20.0, 1)
    other = np.zeros(len(heard), np.float32)
    at = len(heard) // 2 + 8000
    other[at : at + 8000] = 0.03 * np.sin(0.3 * np.arange(8000))
    rest = EchoCanceller().take(own_voice(), heard + other)
    assert level_db(rest[at : at + 8000]) == pytest.approx(level_db(other[at : at + 8000]), abs=3.0)


def test_blocks_of_any_size_give_the_same() -> None:
    played, heard = own_voice()[:32000], through_room(own_voice(), 20.0, 2)[:32000]
    filters = EchoCanceller(), EchoCanceller()
    whole = filters[0].take(played, heard)
    cut = np.concatenate([filters[1].take(played[i : i + 333], heard[i : i + 333]) for i in range(0, 32000, 333)])
    np.testing.assert_array_equal(cut, whole[: len(cut)])


def second_sentence(sound: Samples) -> int:
    """The block with which it begins."""
    return len(sound) // 2 // BLOCK * BLOCK


def listen(
    heard: Samples,
    recogniser: BargeInDetector,
    gap: int | None = None,
    played: Samples | None = None,
    since: int = 0,
    until: int | None = None,
) -> list[KeywordEvent]:
    """To both sentences, or `since` the second; the sound is played one block before it is heard. From `gap` on
    something was not played; the own voice is heard `until` that sample."""
    told: list[KeywordEvent] = []
    played = own_voice() if played is None else played
    for at in range(since, len(heard), BLOCK):
        if at in (0, second_sentence(heard)):
            recogniser.begin(at, 0.0)
        if gap is not None and at <= gap < at + BLOCK:
            recogniser.disturb()
        recogniser.play(played[at : at + BLOCK])
        told += recogniser.hear(heard[at : at + BLOCK], until is None or at < until)
    return told + recogniser.hear(heard[:BLOCK], False)


def call(voice: str, level: float) -> Samples:
    said = sound().speaker_of(voice).render([["stop"]])
    return np.asarray(level * said / np.sqrt(np.mean(np.square(said))), np.float32)


def test_the_own_talk_is_not_taken_for_stop() -> None:
    assert listen(through_room(own_voice(), 20.0, 3), make_barge_in_detector()) == []


@pytest.mark.parametrize("late_ms", [0.3, 20.0, 40.0])
def test_stop_is_heard_over_the_own_voice_that_is_three_times_as_loud(late_ms: float) -> None:
    heard = through_room(own_voice(), late_ms, 4)
    own = float(np.sqrt(np.mean(np.square(heard[np.abs(heard) > 1e-3]))))
    stop = call("Max", own * 10.0 ** (-10.0 / 20.0))
    at = len(heard) // 2 + SAMPLE_RATE_HZ
    heard[at : at + len(stop)] += stop
    told = listen(heard, make_barge_in_detector())
    assert len(told) == 1
    assert at < told[0].end_sample < at + len(stop) + 0.2 * SAMPLE_RATE_HZ


@pytest.mark.parametrize("rubbish", [np.nan, np.inf, -1e30])
def test_samples_that_are_no_sound_deafen_nobody_for_longer(rubbish: float) -> None:
    """A sound server's filter may give them; the echo canceller learned from them, and was deaf to every later call."""
    heard, _ = called_over_the_second_sentence((1.2,))
    heard[20_000:20_100] = rubbish
    assert [type(event) for event in listen(heard, make_barge_in_detector())] == [Urgent]


def called_over_the_second_sentence(at_s: tuple[float, ...]) -> tuple[Samples, int]:
    """The own voice with calls 5 dB below it, `at_s` after the second sentence's beginning, which is returned too."""
    heard = through_room(own_voice(), 20.0, 4)
    stop = call("Max", float(np.sqrt(np.mean(np.square(heard[np.abs(heard) > 1e-3])))) * 10.0 ** (-5.0 / 20.0))
    half = len(heard) // 2
    for start in (half + round(seconds * SAMPLE_RATE_HZ) for seconds in at_s):
        heard[start : start + len(stop)] += stop
    return heard, half


def test_a_word_soon_after_a_gap_in_what_was_played_is_held_and_let_go() -> None:
    heard, half = called_over_the_second_sentence((0.6,))
    told = listen(heard, make_barge_in_detector(), half)
    assert [type(event) for event in told] == [Held, Released]


def test_a_word_that_is_said_twice_soon_after_a_gap_is_believed() -> None:
    heard, half = called_over_the_second_sentence((0.6, 1.7))
    told = listen(heard, make_barge_in_detector(), half)
    assert [type(event) for event in told] == [Held, Urgent]
    assert told[0].end_sample < told[1].start_sample < told[0].end_sample + HOLD_TIME


def test_a_word_long_after_a_gap_is_believed_at_once() -> None:
    heard, half = called_over_the_second_sentence((1.2,))
    told = listen(heard, make_barge_in_detector(), half - MEMORY)
    assert [type(event) for event in told] == [Urgent]


def test_what_is_held_is_held_for_two_seconds_though_the_own_sentence_ends() -> None:
    """It was let go as the sentence ended, so that nobody saw the robot halt."""
    recogniser = make_barge_in_detector()
    heard, half = called_over_the_second_sentence((0.6,))
    told: dict[type, int] = {}
    recogniser.begin(0, 0.0)
    recogniser.disturb()
    for at in range(half, len(heard), BLOCK):
        recogniser.play(own_voice()[at : at + BLOCK])
        told |= {type(event): at for event in recogniser.hear(heard[at : at + BLOCK], not told)}
    assert list(told) == [Held, Released]
    assert abs(told[Released] - told[Held] - HOLD_TIME) <= BLOCK


@pytest.mark.parametrize("over_s", [0.1, 0.3])
def test_a_call_over_the_end_of_the_own_sentence_is_heard(over_s: float) -> None:
    """The recogniser hears only the end of such a call, and the detector no longer listened when it ended."""
    heard, stop = through_room(own_voice(), 20.0, 4), np.trim_zeros(call("Max", 0.05))
    end = len(heard) - SAMPLE_RATE_HZ
    at = end + round(over_s * SAMPLE_RATE_HZ) - len(stop)
    heard[at : at + len(stop)] += stop
    told = listen(heard, make_barge_in_detector(), until=end + round(0.12 * SAMPLE_RATE_HZ))
    assert isinstance(told[-1], Urgent)


@pytest.mark.parametrize("seed", range(4))
def test_a_knock_as_the_own_sentence_ends_stops_nobody(seed: int) -> None:
    rng = np.random.default_rng(seed)
    heard = through_room(own_voice(), 20.0, 4)
    knock = 0.2 * rng.standard_normal(1280) * np.exp(-np.arange(1280) / 213.0)
    end = len(heard) - SAMPLE_RATE_HZ
    at = end + round(rng.uniform(-0.3, 0.4) * SAMPLE_RATE_HZ)
    heard[at : at + len(knock)] += knock.astype(np.float32)
    told = listen(heard, make_barge_in_detector(), until=end + round(0.12 * SAMPLE_RATE_HZ))
    assert not any(isinstance(event, Urgent) for event in told)


def test_a_call_after_the_own_sentence_is_left_to_the_recogniser() -> None:
    heard, stop = through_room(own_voice(), 20.0, 4), np.trim_zeros(call("Max", 0.05))
    end = len(heard) - SAMPLE_RATE_HZ
    at = end + round(0.3 * SAMPLE_RATE_HZ)
    heard[at : at + len(stop)] += stop
    assert listen(heard, make_barge_in_detector(), until=end + round(0.12 * SAMPLE_RATE_HZ)) == []


def test_own_words_round_a_gap_in_what_was_played_stop_nobody() -> None:
    """The loudspeaker leaves out 0.15 s, at every other place of the second sentence. Two of these stopped the robot.

    The first sentence, from which the way of the sound is learned, is heard once for all.
    """
    played = own_voice("Max", orange=True)
    second, learned = second_sentence(played), make_barge_in_detector()
    first = through_room(played, 20.0, 3)[:second]
    learned.begin(0, 0.0)
    for at in range(0, second, BLOCK):
        learned.play(played[at : at + BLOCK])
        assert learned.hear(first[at : at + BLOCK], True) == []
    for gap in range(len(played) // 2, len(played) - SAMPLE_RATE_HZ, SAMPLE_RATE_HZ // 10):
        really = played.copy()
        really[gap : gap + round(0.15 * SAMPLE_RATE_HZ)] = 0.0
        told = listen(through_room(really, 20.0, 3), deepcopy(learned), gap, played, second)
        assert not any(isinstance(event, Urgent) for event in told)


def test_after_the_own_sentence_it_does_not_listen() -> None:
    recogniser = make_barge_in_detector()
    recogniser.begin(0, 0.0)
    recogniser.hear(np.zeros(BLOCK, np.float32), False)
    stop = call("Max", 0.1)
    assert not any(recogniser.hear(stop[i : i + BLOCK], True) for i in range(0, len(stop), BLOCK))


def test_its_own_word_that_comes_later_than_expected_never_stops_it() -> None:
    """Whatever makes the loudspeaker late, the daemon need not notice it: the sound system, or a mixer."""
    stop = call("Rob", 0.2)
    played = own_voice().copy()
    half = len(played) // 2
    for start in (half + 9600, half + 27200):
        played[start : start + 9600] = np.pad(stop, (0, 9600))[:9600]
    heard = through_room(played, 20.0, 5)
    late = half + 8000
    heard[late:] = through_room(np.pad(played, (1600, 0))[: len(played)], 20.0, 5)[late:]
    told = listen(heard, make_barge_in_detector(), played=played)
    assert Held in {type(event) for event in told}
    assert Urgent not in {type(event) for event in told}
