"""Which of several listeners' sentences is right, and how likely."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hvcpd.language.graph import Arc, WordGraph, graph_of
from hvcpd.people.fusion import MOST_LOG_ODDS, FusedHypothesis, Hypotheses, fuse
from hvcpd.people.phones import PHONES, CtcSearch, word_loop
from hvcpd.recognition.events import Recognised, WordSpan

SAID: dict[str, list[tuple[str, ...]]] = {
    "turn": [("T", "ER", "N")],
    "left": [("L", "EH", "F", "T")],
    "right": [("R", "AY", "T")],
}
GRAPH = WordGraph(3, (Arc(0, 1, "turn"), Arc(1, 2, "left"), Arc(1, 2, "right")), 0, frozenset((2,)), frozenset())
TALK = word_loop(
    ("turn", "left", "right", "life", "earn"),
    {**SAID, "life": [("L", "AY", "F")], "earn": [("ER", "N")]}.__getitem__,
    4.0,
)
NONE = len(PHONES)
LEFT, RIGHT = ("turn", "left"), ("turn", "right")


def hypotheses(*said: str, clear: float = 8.0, nearest: Recognised | None = None) -> Hypotheses:
    """Words that the net hears, each phone so much likelier than any other as `clear` says, natural logarithm."""
    phones = [phone for word in said for phone in (*SAID[word][0], "")]
    log_posteriors = np.full((2 * len(phones), NONE + 1), -clear, np.float32)
    for k, phone in enumerate(phones):
        log_posteriors[2 * k : 2 * k + 2, PHONES.index(phone) if phone else NONE] = 0.0
    search = CtcSearch(GRAPH, SAID.__getitem__)
    return Hypotheses([log_posteriors], search, TALK, nearest)


def enrolled(words: tuple[str, ...], confidence: float) -> Recognised:
    """The sentence that is nearest to enrolled people's words."""
    spans = tuple(WordSpan(w, 3200 * k, 3200 * (k + 1), confidence) for k, w in enumerate(words))
    return Recognised(words, "anna, enrolled", 0, 6400, confidence, math.inf, spans)


def fused(found: Hypotheses) -> FusedHypothesis:
    out = fuse(found)
    assert out is not None
    return out


def test_what_is_clearly_heard_is_right() -> None:
    found = fused(hypotheses("turn", "left"))
    assert found.words == LEFT
    assert found.probability > 0.8


def test_who_hears_the_same_makes_it_surer_and_who_hears_another_does_not() -> None:
    alone, doubtful = (fused(hypotheses("turn", "left", clear=clear)).probability for clear in (8.0, 1.2))
    agreed = fused(hypotheses("turn", "left", nearest=enrolled(LEFT, 0.9)))
    disputed = fused(hypotheses("turn", "left", clear=1.2, nearest=enrolled(RIGHT, 0.6)))
    assert (agreed.words, disputed.words) == (LEFT, LEFT)
    assert agreed.probability > alone
    assert disputed.probability == doubtful


def test_the_odds_are_those_against_all_other_sentences_and_other_talk() -> None:
    """A word that could be another says less, a short sentence less than a long one: any talk has such words."""
    clear, unclear = (hypotheses("turn", "left", clear=each) for each in (8.0, 0.6))
    assert MOST_LOG_ODDS >= clear.log_odds(LEFT) > 7.0 > unclear.log_odds(LEFT)
    assert clear.log_odds(RIGHT) == -MOST_LOG_ODDS
    search = CtcSearch(graph_of(("left",)), SAID.__getitem__)
    short = replace(hypotheses("left"), search=search)
    assert short.log_odds(("left",)) < 4.1


def test_a_sentence_may_be_the_beginning_of_another() -> None:
    """Somebody who pauses within "turn left" has not said "turn"."""
    arcs = (Arc(0, 1, "turn"), Arc(1, 2, "left"), Arc(0, 2, "turned"))
    said = {**SAID, "turned": [("T", "ER", "N", "D")]}
    search = CtcSearch(WordGraph(3, arcs, 0, frozenset((2,)), frozenset()), said.__getitem__)
    paused = replace(hypotheses("turn"), search=search)
    assert paused.log_odds(("turned",)) < -6.0


def test_the_surer_an_enrolled_sentence_the_more_it_counts() -> None:
    for confidence, words in ((0.999, RIGHT), (0.05, LEFT)):
        nearest = enrolled(RIGHT, confidence)
        assert fused(hypotheses("turn", "left", clear=0.4, nearest=nearest)).words == words


def test_silence_around_a_sentence_does_not_change_its_odds() -> None:
    strange = hypotheses("turn", "left").posteriors[0]
    strange[6:12, PHONES.index("AA")] = 0.4  # in a strange voice
    silence = np.full((40, NONE + 1), -8.0, np.float32)
    silence[:, NONE] = 0.0
    search, odds = CtcSearch(GRAPH, SAID.__getitem__), []
    for heard in (strange, np.concatenate([silence, strange, silence])):
        odds.append(Hypotheses([heard], search, TALK, None).log_odds(LEFT))
    assert odds[0] > 0.0
    assert odds[1] == pytest.approx(odds[0], abs=0.1)


def test_what_no_row_of_phones_explains_is_unlikely() -> None:
    noise = hypotheses("turn", "left")
    log_posteriors = np.log(np.random.default_rng(3).dirichlet(np.full(NONE + 1, 0.05), 60) + 1e-6).astype(np.float32)
    found = Hypotheses([log_posteriors], noise.search, TALK, None)
    assert fused(found).probability < 0.1


def test_a_sentence_that_cannot_be_has_the_least_odds() -> None:
    short = hypotheses("turn", "left")
    brief = Hypotheses([short.posteriors[0][:3]], short.search, TALK, enrolled(RIGHT, 0.9))
    assert brief.log_odds(RIGHT) == -MOST_LOG_ODDS
    assert len(brief.spans(RIGHT)) == 2
    assert fused(brief).words == RIGHT


def test_whoever_is_to_halt_it_is_a_call() -> None:
    said = {**SAID, "stop": [("S", "T", "AA", "P")], "rob": [("R", "AA", "B")], "all": [("AO", "L")]}
    arcs = (Arc(0, 1, "rob"), Arc(0, 1, "all"), Arc(1, 2, "stop"), Arc(0, 3, "turn"), Arc(3, 2, "left"))
    search = CtcSearch(WordGraph(4, arcs, 0, frozenset((2,)), frozenset()), said.__getitem__)
    log_posteriors = np.full((12, NONE + 1), -8.0, np.float32)
    for k, phone in enumerate(("AO", "L", "S", "T", "AA", "P")):
        log_posteriors[2 * k : 2 * k + 2, PHONES.index(phone)] = 0.0
    alone = Hypotheses([log_posteriors], search, TALK, None)
    same, other, else_ = (
        fused(replace(alone, by_takes=enrolled(words, 0.5))) for words in (("all", "stop"), ("rob", "stop"), LEFT)
    )
    assert {same.words, other.words, else_.words} == {("all", "stop")}
    assert same.probability == other.probability > else_.probability


def test_nothing_heard_is_no_sentence() -> None:
    heard = hypotheses("turn", "left")
    assert fuse(Hypotheses([heard.posteriors[0][:0]], heard.search, TALK, None)) is None


def test_wordings_of_one_sentence_do_not_compete() -> None:
    """Between "hi I am" and "hi all I am" the net could not decide, and neither was sure."""
    said = {"hi": [("HH", "AY")], "hello": [("HH", "OW")], "all": [("AO", "L")], "i": [("AY",)], "busy": [("B", "IH")]}
    arcs = (Arc(0, 1, "hi"), Arc(0, 1, "hello"), Arc(1, 2, "all"), Arc(1, 3, "i"), Arc(2, 3, "i"), Arc(3, 4, "busy"))
    search = CtcSearch(WordGraph(5, arcs, 0, frozenset((4,)), frozenset()), said.__getitem__)
    log_posteriors = np.full((16, NONE + 1), -8.0, np.float32)
    for k, phone in enumerate(("HH", "AY", "AO", "L", "AY", "B", "IH", None)):
        log_posteriors[2 * k : 2 * k + 2, PHONES.index(phone) if phone else NONE] = 0.0
    log_posteriors[4:8] = -1.5  # anything
    heard = Hypotheses([log_posteriors], search, TALK, None)
    assert heard.by_phones is not None
    assert heard.log_odds(heard.by_phones.words) > 4.0


def test_of_two_nets_the_surer_one_decides() -> None:
    left, right = hypotheses("turn", "left"), hypotheses("turn", "right", clear=2.0)
    for posteriors in ([*left.posteriors, *right.posteriors], [*right.posteriors, *left.posteriors]):
        both = Hypotheses(posteriors, left.search, TALK, None)
        assert fused(both).words == LEFT
        assert both.log_odds(LEFT) == left.log_odds(LEFT) > both.log_odds(RIGHT) == right.log_odds(RIGHT)
