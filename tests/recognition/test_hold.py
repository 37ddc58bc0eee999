"""Whether a word heard over talk was said is decided by the sentence that it was heard in."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.hold import Hold, HoldSettings, Verdict

SETTINGS = HoldSettings()
SURE = 0.999
ALONE = 0.1
"""What the first second of the sentences below shows of the word by itself."""
WORDS = ("hi", "rob", "i", "am", "bot")


def samples(s: float) -> int:
    return round(s * SAMPLE_RATE_HZ)


def sentence(begin_s: float, words: Sequence[str] = WORDS, unsure: int | None = None) -> Recognised:
    """Half a second a word, the one numbered `unsure` a little too far from what was heard."""
    deficits = [SETTINGS.most_deficit + (0.01 if k == unsure else -0.01) for k in range(len(words))]
    ends = [samples(begin_s + 0.5 * k) for k in range(len(words) + 1)]
    spans = tuple(map(WordSpan, words, ends, ends[1:], [SURE] * len(words), deficits))
    return Recognised(tuple(words), "oak", spans[0].start_sample, spans[-1].end_sample, SURE, 20.0, spans)


def hold() -> Hold:
    return Hold(frozenset({"stop", "stopped"}), lambda _sentence, start, _end: ALONE if start < samples(2.0) else 0.0)


def word(hold: Hold, begin_s: float, score: float = 0.0) -> Verdict:
    return hold.word(samples(begin_s), samples(begin_s + 0.5), score, samples(begin_s + 0.7))


def test_a_sure_sentence_around_the_word_releases() -> None:
    held = hold()
    assert word(held, 1.2) is Verdict.HELD
    assert held.held
    assert held.sentence(sentence(1.0)) is Verdict.RELEASED
    assert not held.held


@pytest.mark.parametrize("unsure", [0, 1])
def test_an_unsure_word_at_that_time_is_the_stop(unsure: int) -> None:
    held = hold()
    word(held, 1.2)
    assert held.sentence(sentence(1.0, unsure=unsure)) is Verdict.SAID
    assert not held.held


@pytest.mark.parametrize(("is_gone", "expected"), [(True, Verdict.RELEASED), (False, Verdict.SAID)])
def test_nothing_left_of_the_word_without_the_sentence_tells_more_than_how_its_words_fit(
    is_gone: bool, expected: Verdict
) -> None:
    doubtful = replace(sentence(1.0), confidence=SETTINGS.sentence_confidence - 0.01)
    for heard, verdict in ((sentence(1.0, unsure=0), expected), (doubtful, Verdict.SAID)):
        held = Hold(frozenset({"stop"}), lambda *_: ALONE, subtracted=lambda *_: is_gone)
        word(held, 1.2)
        assert held.sentence(heard) is verdict


@pytest.mark.parametrize("unsure", [2, 3, 4])
def test_an_unsure_word_at_another_time_is_none(unsure: int) -> None:
    held = hold()
    word(held, 1.2)
    assert held.sentence(sentence(1.0, unsure=unsure)) is Verdict.RELEASED


def test_an_unsure_sentence_is_the_stop() -> None:
    held = hold()
    word(held, 1.2)
    doubtful = replace(sentence(1.0), confidence=SETTINGS.sentence_confidence - 0.01)
    assert held.sentence(doubtful) is Verdict.SAID


@pytest.mark.parametrize("begin_s", [0.8, 3.2, 4.0])
def test_a_word_that_the_sentence_does_not_cover_is_the_stop_or_waits(begin_s: float) -> None:
    held = hold()
    word(held, begin_s)
    later = begin_s == 4.0  # said after the sentence: another one may cover it
    assert held.sentence(sentence(1.0)) is (Verdict.UNCHANGED if later else Verdict.SAID)
    assert held.held is later


def test_what_is_not_understood_or_lost_is_the_stop() -> None:
    held = hold()
    assert held.unclear() is Verdict.UNCHANGED
    word(held, 1.2)
    assert held.unclear() is Verdict.SAID
    assert held.unclear() is Verdict.UNCHANGED


def test_two_calls_must_both_be_other_talk() -> None:
    both, one = hold(), hold()
    for held in (both, one):
        assert word(held, 1.2) is Verdict.HELD
        assert word(held, 2.6) is Verdict.HELD
    assert both.sentence(sentence(1.0)) is Verdict.RELEASED
    assert one.sentence(sentence(1.0, unsure=4)) is Verdict.SAID


def test_a_second_call_after_the_sentence_keeps_the_robot_standing() -> None:
    held = hold()
    word(held, 1.2)
    word(held, 4.3)
    assert held.sentence(sentence(1.0)) is Verdict.UNCHANGED
    assert held.held
    assert held.sentence(sentence(4.0)) is Verdict.RELEASED


def test_a_clear_call_is_the_stop_at_once_and_decides_what_is_held() -> None:
    held = hold()
    word(held, 1.2)
    assert word(held, 2.0, SETTINGS.certain_score) is Verdict.SAID
    assert held.sentence(sentence(1.0)) is Verdict.UNCHANGED


@pytest.mark.parametrize("begin_s", [1.2, 2.6])
def test_more_of_the_word_than_the_sentence_shows_by_itself_is_the_stop(begin_s: float) -> None:
    most = SETTINGS.most_excess + (ALONE if begin_s < 2.0 else 0.0)
    for score, verdict in ((most - 0.01, Verdict.RELEASED), (most + 0.01, Verdict.SAID)):
        held = hold()
        assert word(held, begin_s, score) is Verdict.HELD
        assert held.sentence(sentence(1.0)) is verdict


def test_stopped_may_look_as_much_like_stop_as_it_will() -> None:
    held = hold()
    assert word(held, 2.1, SETTINGS.certain_score - 0.01) is Verdict.HELD
    assert held.sentence(sentence(1.0, ("i", "have", "stopped"))) is Verdict.RELEASED


def test_a_sentence_told_before_the_word_explains_it_too() -> None:
    held = hold()
    held.sentence(sentence(1.0, unsure=0))
    assert word(held, 2.6) is Verdict.UNCHANGED
    assert word(held, 1.2) is Verdict.HELD


def test_the_word_as_part_of_a_sentence_is_for_the_conversation() -> None:
    held = hold()
    word(held, 2.1)
    assert held.sentence(sentence(1.0, ("i", "have", "stopped"), unsure=2)) is Verdict.RELEASED
    word(held, 5.1)
    assert held.sentence(sentence(5.0, ("i", "have", "stopped"), unsure=0)) is Verdict.SAID


def test_silence_without_a_sentence_and_endless_talk_are_the_stop() -> None:
    quiet, endless = hold(), hold()
    word(quiet, 1.2)
    word(endless, 1.2)
    assert quiet.at(samples(2.5), samples(2.5 - SETTINGS.quiet_s) + 1) is Verdict.UNCHANGED
    assert quiet.at(samples(2.5), samples(2.5 - SETTINGS.quiet_s)) is Verdict.SAID
    told_s = 1.9
    assert endless.at(samples(told_s + SETTINGS.longest_s) - 1, samples(told_s + 7.9)) is Verdict.UNCHANGED
    assert endless.at(samples(told_s + SETTINGS.longest_s), samples(told_s + 7.9)) is Verdict.SAID
    assert endless.at(samples(100.0), 0) is Verdict.UNCHANGED


ALIKE = 0.4
"""A score of the word at which a phrase of the same score excuses it."""


def excused(hold: Hold, begin_s: float, excuse: float = ALIKE) -> Verdict:
    return hold.word(samples(begin_s), samples(begin_s + 0.5), ALIKE, samples(begin_s + 0.7), excuse)


def test_a_word_that_a_phrase_excuses_halts_for_a_while_after_garbled_talk() -> None:
    held = hold()
    assert excused(held, 1.2) is Verdict.HELD
    assert held.at(samples(3.0), samples(3.0)) is Verdict.UNCHANGED
    assert held.unclear() is Verdict.UNCHANGED
    assert held.held
    over = samples(3.0 + SETTINGS.doubt_s)
    assert held.at(over - 1, 0) is Verdict.UNCHANGED
    assert held.sentence(sentence(3.0)) is Verdict.UNCHANGED
    assert held.at(over, 0) is Verdict.RELEASED
    assert not held.held
    assert held.at(over + 1, 0) is Verdict.UNCHANGED


@pytest.mark.parametrize(("lag", "verdict"), [(-0.01, Verdict.UNCHANGED), (0.01, Verdict.SAID)])
def test_a_phrase_that_is_found_much_less_than_the_word_excuses_nothing(lag: float, verdict: Verdict) -> None:
    held = hold()
    excused(held, 1.2, ALIKE - SETTINGS.excuse_lag - lag)
    assert held.unclear() is verdict


def test_the_word_once_more_while_in_doubt_is_the_stop_at_once() -> None:
    held = hold()
    excused(held, 1.2)
    held.unclear()
    assert word(held, 4.0, ALIKE) is Verdict.SAID
    assert not held.held


def test_another_excused_word_while_in_doubt_prolongs_it() -> None:
    held = hold()
    excused(held, 1.2)
    held.at(samples(3.0), samples(3.0))
    held.unclear()
    assert excused(held, 5.0) is Verdict.HELD
    assert held.at(samples(7.0), samples(5.9)) is Verdict.UNCHANGED
    assert held.at(samples(3.0 + SETTINGS.doubt_s), samples(5.9)) is Verdict.UNCHANGED
    assert held.held
    assert held.at(samples(9.0 + SETTINGS.doubt_s), samples(5.9)) is Verdict.RELEASED


def test_one_word_without_an_excuse_is_enough() -> None:
    held = hold()
    excused(held, 1.2)
    word(held, 2.6, ALIKE)
    assert held.unclear() is Verdict.SAID


@pytest.mark.parametrize(("excess", "verdict"), [(-0.01, Verdict.RELEASED), (0.01, Verdict.SAID)])
def test_stopped_does_not_hide_a_call_that_covers_it(excess: float, verdict: Verdict) -> None:
    held, told = hold(), sentence(1.0, ("i", "have", "stopped"))
    covered = replace(told.spans[2], deficit=SETTINGS.most_own_deficit + excess)
    told = replace(told, spans=(*told.spans[:2], covered))
    assert word(held, 2.1, SETTINGS.certain_score - 0.01) is Verdict.HELD
    assert held.accounts(told) is (verdict is Verdict.RELEASED)
    assert held.sentence(told) is verdict
