"""Whether a word that sounded like the keyword was said is decided by how sure it is, and by the sentence around it."""

import math
from collections.abc import Sequence

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.special import expit, logit

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Held, Recognised, Released, Urgent, WordSpan
from hvcpd.recognition.keyword.verification import (
    ACCEPT_PROBABILITY,
    CLEAR_PROBABILITY,
    HOLD_TIME,
    JOINT_LOG_ODDS,
    PLAUSIBLE_PROBABILITY,
    REPEAT_WINDOW,
    RESIDUAL_LOG_ODDS,
    SENTENCE_BASELINE,
    SENTENCE_WAIT,
    WORD_DELAY,
    CallVerifier,
    Residual,
    Verdict,
)

SURE = 0.999
WORDS = ("hi", "rob", "i", "am", "bot")
DOUBTFUL = ACCEPT_PROBABILITY - 0.01


def samples(s: float) -> int:
    return round(s * SAMPLE_RATE_HZ)


def sentence(begin_s: float, words: Sequence[str] = WORDS) -> Recognised:
    """Half a second a word."""
    ends = [samples(begin_s + 0.5 * k) for k in range(len(words) + 1)]
    spans = tuple(map(WordSpan, words, ends, ends[1:], [SURE] * len(words)))
    return Recognised(tuple(words), "oak", spans[0].start_sample, spans[-1].end_sample, SURE, 20.0, spans)


def verifier() -> CallVerifier:
    return CallVerifier(lambda *_: None)


def word(verifier: CallVerifier, begin_s: float, probability: float = DOUBTFUL, ends: bool = False) -> Verdict:
    """The word is told 0.1 s after its end."""
    return verifier.detected(samples(begin_s), samples(begin_s + 0.5), probability, samples(begin_s + 0.6), ends)


def heard_again(verifier: CallVerifier, begin_s: float, probability: float = DOUBTFUL, ends: bool = False) -> Verdict:
    """The word is told, and 0.8 s after its end its last probability."""
    start, end, now = samples(begin_s), samples(begin_s + 0.5), samples(begin_s + 0.6)
    first = verifier.detected(start, end, probability, now, ends)
    last = verifier.detected(start, end, probability, samples(begin_s + 1.3), ends, again=True)
    return last or first


def test_a_certain_word_counts_at_once_and_another_one_is_held_for() -> None:
    held = verifier()
    assert word(held, 1.2, ACCEPT_PROBABILITY) is Urgent
    assert not held.pending
    assert word(held, 3.2, ACCEPT_PROBABILITY - 0.01) is Held
    assert held.pending


def test_a_call_counts_once_however_probable_it_becomes() -> None:
    held = verifier()
    assert word(held, 1.2, ACCEPT_PROBABILITY) is Urgent
    assert word(held, 1.2, SURE) is None
    assert word(held, 2.2, SURE) is Urgent, "another one"


def test_a_word_that_grows_certain_is_one_word() -> None:
    held = verifier()
    assert word(held, 1.2, PLAUSIBLE_PROBABILITY) is Held
    assert word(held, 1.2, DOUBTFUL) is None
    assert word(held, 1.2, ACCEPT_PROBABILITY) is Urgent


def test_a_certain_word_waits_for_the_sentence_that_it_may_be_part_of() -> None:
    told, silent = verifier(), verifier()
    for held in (told, silent):
        assert word(held, 3.0, SURE, ends=True) is Held
    assert told.recognised(sentence(2.5, ("rob", "stop"))) is Released
    at = samples(3.6) + SENTENCE_WAIT
    assert silent.advance(at - 1) is None
    assert silent.advance(at) is Urgent


def followed(verifier: CallVerifier, begin_s: float, probability: float) -> Verdict:
    """A word that a sentence in progress seems to account for."""
    return verifier.detected(
        samples(begin_s), samples(begin_s + 0.5), probability, samples(begin_s + 0.6), followed=True
    )


def test_nobody_stands_still_for_a_word_of_a_sentence_in_progress_that_is_not_certain() -> None:
    held, certain = verifier(), verifier()
    assert followed(held, 1.2, PLAUSIBLE_PROBABILITY) is None
    assert followed(held, 1.2, DOUBTFUL) is None
    assert held.is_uncertain(samples(1.2))
    assert not held.pending
    assert word(held, 1.2, DOUBTFUL) is Held
    assert followed(certain, 1.2, ACCEPT_PROBABILITY) is Urgent


def test_a_word_of_a_sentence_in_progress_still_counts_if_it_is_said_again_or_remains_without_the_sentence() -> None:
    again, over = verifier(), CallVerifier(lambda *_: Residual(0.9, NEARLY_ALL, 0.0))
    for held in (again, over):
        assert followed(held, 1.2, DOUBTFUL) is None
    assert heard_again(again, 1.2) is Held
    assert heard_again(again, 2.2) is Urgent
    assert over.recognised(sentence(0.2)) is Urgent


def test_a_sentence_around_the_word_releases_if_its_samples_are_unknown() -> None:
    held = verifier()
    assert word(held, 1.2) is Held
    assert held.recognised(sentence(1.0)) is Released
    assert not held.pending


def test_a_certain_word_waits_as_long_as_a_sentence_goes_on() -> None:
    explained, silent, before = verifier(), verifier(), verifier()
    for held, begin_s in ((explained, 1.2), (silent, 1.2), (before, 0.2)):
        assert word(held, begin_s, ACCEPT_PROBABILITY, ends=True) is Held
        told = [held.advance(samples(begin_s + 0.6 + t / 10), in_progress=True) for t in range(20)]
        assert told == [None] * 20
    assert explained.recognised(sentence(1.0)) is Released
    for held in (silent, before):
        assert held.advance(samples(5.0)) is Urgent


def test_a_very_probable_call_is_not_explained_by_a_sentence_whose_samples_are_unknown() -> None:
    """Of 25 calls by people, louder than the robot they spoke over, 14 were released by its sentence."""
    held, word_of_it = verifier(), verifier()
    for each in (held, word_of_it):
        assert word(each, 1.2, CLEAR_PROBABILITY, ends=True) is Held
    assert held.recognised(sentence(1.0)) is Urgent
    assert word_of_it.recognised(sentence(1.0, ("hi", "rob", "i", "have", "stopped"))) is Urgent
    assert word(word_of_it, 5.2, CLEAR_PROBABILITY, ends=True) is Held
    assert word_of_it.recognised(sentence(5.2, ("stop", "please"))) is Released


@pytest.mark.parametrize("begin_s", [0.8, 3.2, 4.0])
def test_a_certain_word_that_the_sentence_does_not_cover_is_the_stop_once_it_has_waited(begin_s: float) -> None:
    held = verifier()
    word(held, begin_s, SURE, ends=True)
    assert held.recognised(sentence(1.0)) is None
    assert held.advance(samples(begin_s + 0.6) + SENTENCE_WAIT) is Urgent


def test_what_is_not_understood_or_lost_is_the_stop_if_that_is_certain() -> None:
    sure, doubtful = verifier(), verifier()
    assert sure.not_recognised() is None
    word(sure, 1.2, SURE, ends=True)
    word(doubtful, 1.2)
    assert sure.not_recognised() is Urgent
    assert sure.not_recognised() is None
    assert doubtful.not_recognised() is None
    assert doubtful.pending


def test_what_was_not_understood_before_a_word_says_nothing_of_it() -> None:
    held = verifier()
    word(held, 1.2, SURE, ends=True)
    assert held.not_recognised(samples(1.1)) is None
    assert held.not_recognised(samples(1.5)) is Urgent


@pytest.mark.parametrize("followed", [True, False])
def test_a_second_call_waits_as_a_certain_one_does_for_the_sentence_that_it_may_be_part_of(followed: bool) -> None:
    """Noise that sounded like a call, and four seconds later a word of a sentence that did: that stopped a team."""
    held = verifier()
    assert heard_again(held, 1.2) is Held
    assert held.advance(samples(1.8) + HOLD_TIME) is Released
    assert heard_again(held, 5.2, ends=True) is Held
    assert held.advance(samples(5.8) + SENTENCE_WAIT - 1) is None
    if followed:
        assert held.recognised(sentence(4.2, ("hi", "rob", "skip", "task", "two"))) is Released
    assert held.advance(samples(5.8) + SENTENCE_WAIT) is (None if followed else Urgent)


def test_a_doubtful_word_is_let_go_after_a_while_whatever_is_said_meanwhile() -> None:
    for other_s in (None, 1.5):
        held = verifier()
        assert word(held, 1.2, DOUBTFUL) is Held
        over = samples(1.8) + HOLD_TIME
        assert held.advance(over - 1) is None
        if other_s is not None:
            assert held.not_recognised() is None
            assert held.recognised(sentence(other_s)) is None
        assert held.advance(over) is Released
        assert not held.pending
        assert held.advance(over + 1) is None


@pytest.mark.parametrize(
    "probabilities",
    [
        (DOUBTFUL, PLAUSIBLE_PROBABILITY - 0.01),
        (PLAUSIBLE_PROBABILITY - 0.01, DOUBTFUL),
        (PLAUSIBLE_PROBABILITY, PLAUSIBLE_PROBABILITY),
    ],
)
def test_two_words_that_are_not_certain_together_are_none(probabilities: tuple[float, float]) -> None:
    held = verifier()
    for begin_s, chance in zip((1.2, 2.2), probabilities, strict=True):
        assert heard_again(held, begin_s, chance) is Held
    assert held.advance(samples(4.9)) is Released


@given(st.lists(st.floats(0.0, 0.79), min_size=2, max_size=5))
def test_words_soon_after_one_another_count_once_their_log_odds_add_up(probabilities: list[float]) -> None:
    held, odds = verifier(), 1.0
    for k, chance in enumerate(probabilities):
        odds *= chance / (1.0 - chance) if chance >= PLAUSIBLE_PROBABILITY else 1.0
        count = k > 0 and chance >= PLAUSIBLE_PROBABILITY and odds >= CLEAR_PROBABILITY / (1.0 - CLEAR_PROBABILITY)
        assume(abs(odds - 9.0) > 1e-6)
        verdict = heard_again(held, 1.2 + k, chance)
        assert (verdict is Urgent) == count
        if count:
            return


@pytest.mark.parametrize("later_s", [0.5, 1.5, 4.0])
def test_the_word_once_more_is_the_stop_once_it_was_heard_again(later_s: float) -> None:
    held = verifier()
    assert heard_again(held, 1.2) is Held
    held.advance(samples(1.2 + later_s))
    start, end = samples(1.2 + later_s), samples(1.7 + later_s)
    assert held.detected(start, end, DOUBTFUL, samples(1.8 + later_s)) is Held
    assert held.detected(start, end, DOUBTFUL, samples(2.5 + later_s), again=True) is Urgent
    assert not held.pending


def test_what_two_hearings_make_less_probable_is_no_call_though_it_is_repeated() -> None:
    """Dishes in a kitchen, and an "Alexa" that somebody repeated, stopped robots for good."""
    held = verifier()
    for begin_s in (1.2, 3.2):
        start, end = samples(begin_s), samples(begin_s + 0.5)
        assert held.detected(start, end, DOUBTFUL, samples(begin_s + 0.6)) is Held
        assert held.detected(start, end, 0.7, samples(begin_s + 1.3), again=True) is None
    assert held.advance(samples(5.8)) is Released


def test_the_word_once_more_long_after_is_another_one() -> None:
    held = verifier()
    word(held, 1.2, DOUBTFUL)
    held.advance(samples(10.0))
    assert word(held, 1.3 + REPEAT_WINDOW / SAMPLE_RATE_HZ, DOUBTFUL) is Held


def test_a_word_that_a_sentence_explained_does_not_count_for_the_next_one() -> None:
    held = verifier()
    word(held, 1.2, DOUBTFUL)
    assert held.recognised(sentence(1.0)) is Released
    assert word(held, 4.0, DOUBTFUL) is Held


def test_a_sentence_told_before_the_word_explains_it_too() -> None:
    held = verifier()
    held.recognised(sentence(1.0))
    assert word(held, 2.6, SURE) is None
    assert word(held, 3.2) is Held


def test_the_word_as_part_of_a_sentence_is_for_the_conversation() -> None:
    held = verifier()
    word(held, 2.1)
    assert held.recognised(sentence(1.0, ("i", "have", "stopped"))) is Released


NEARLY_ALL = math.nextafter(1.0, 0.0)
"""Of the residual is more than the sentence leaves elsewhere."""


def test_what_cannot_be_subtracted_tells_nothing_new() -> None:
    """In loud noise the residual is the sound itself."""
    held = CallVerifier(lambda *_: Residual(PLAUSIBLE_PROBABILITY, 1.0, 0.0))
    word(held, 1.2, DOUBTFUL)
    assert held.recognised(sentence(0.2)) is None
    sure = CallVerifier(lambda *_: Residual(SURE, 1.0, 0.0))
    word(sure, 1.2, SURE, ends=True)
    assert sure.recognised(sentence(0.2)) is None
    assert sure.advance(samples(3.0)) is Urgent


def asked(left: float) -> CallVerifier:
    """In every sentence the residual has these log odds."""
    return CallVerifier(lambda *_: Residual(float(expit(left)), NEARLY_ALL, SENTENCE_BASELINE))


@pytest.mark.parametrize("left", [-0.3, 0.2, 1.5])
def test_a_word_counts_over_a_sentence_with_what_is_left_of_it(left: float) -> None:
    least = expit(JOINT_LOG_ODDS - left)
    for excess, verdict in ((-0.01, None), (0.01, Urgent)):
        held = asked(left)
        word(held, 1.2, least + excess)
        assert held.recognised(sentence(1.0)) is verdict


@given(call=st.floats(0.01, 0.99), share=st.floats(0.0, 1.0), less=st.floats(0.0, 1.0), alone=st.floats(0.0, 1.0))
def test_the_more_of_a_word_a_sentence_accounts_for_the_less_its_residual_tells(
    call: float, share: float, less: float, alone: float
) -> None:
    left = Residual(call, share, alone).log_odds
    assert Residual(call, share * less, alone).log_odds <= left
    assert left <= Residual(call, share, less * alone).log_odds <= logit(call)


@pytest.mark.parametrize(
    ("left", "verdict"), [(RESIDUAL_LOG_ODDS - 0.01, Released), (RESIDUAL_LOG_ODDS, None), (3.0, Urgent)]
)
def test_what_is_left_without_the_sentence_tells_whatever_its_words_are(left: float, verdict: Verdict) -> None:
    for heard in (sentence(1.0), sentence(1.0, ("i", "stopped", "here"))):
        for chance in (PLAUSIBLE_PROBABILITY, DOUBTFUL):
            held = asked(left)
            assert word(held, 1.2, chance) is Held
            assert held.recognised(heard) is verdict


@pytest.mark.parametrize(("left", "verdict"), [(RESIDUAL_LOG_ODDS, None), (3.0, Urgent)])
def test_a_word_that_was_let_go_counts_once_the_sentence_around_it_is_understood(left: float, verdict: Verdict) -> None:
    held = asked(left)
    word(held, 1.2, PLAUSIBLE_PROBABILITY)
    assert held.advance(samples(1.8) + HOLD_TIME) is Released
    assert held.recognised(sentence(1.0)) is verdict


@pytest.mark.parametrize(
    ("left", "verdict"), [(RESIDUAL_LOG_ODDS - 0.01, Released), (RESIDUAL_LOG_ODDS, None), (3.0, Urgent)]
)
def test_a_sentence_told_before_the_word_is_asked_about_it_once_all_of_it_was_heard(
    left: float, verdict: Verdict
) -> None:
    held = asked(left)
    held.recognised(sentence(1.0))
    assert word(held, 2.6, PLAUSIBLE_PROBABILITY) is Held
    asked_at = samples(3.2) + WORD_DELAY
    assert held.advance(asked_at - 1) is None
    assert held.advance(asked_at) is verdict


@pytest.mark.parametrize(
    ("call", "verdict"), [(CLEAR_PROBABILITY - 0.01, Released), (CLEAR_PROBABILITY + 0.01, Urgent)]
)
def test_a_sentence_begins_with_what_is_like_the_word_unless_a_call_is_surely_left(
    call: float, verdict: Verdict
) -> None:
    """With an automatic gain, "hi I am Mia" was a call of 0.88, and of 0.87 without the sentence."""
    held = asked(logit(call))
    word(held, 0.9)
    assert held.recognised(sentence(1.1)) is verdict
