"""Which of several listeners' sentences is right, and how likely."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hvcpd.language.graph import Arc, WordGraph, graph_of
from hvcpd.people.fusion import MOST_LOSS, Fused, Hypotheses, evidence, fuse
from hvcpd.people.phones import PHONES, CtcSearch
from hvcpd.recognition.events import Recognised, WordSpan

SAID = {"turn": [("T", "ER", "N")], "left": [("L", "EH", "F", "T")], "right": [("R", "AY", "T")]}
GRAPH = WordGraph(3, (Arc(0, 1, "turn"), Arc(1, 2, "left"), Arc(1, 2, "right")), 0, frozenset((2,)), frozenset())
NONE = len(PHONES)
LEFT, RIGHT = ("turn", "left"), ("turn", "right")


def hypotheses(*said: str, clear: float = 8.0, nearest: Recognised | None = None, speech_s: float = 0.7) -> Hypotheses:
    """Words that the net hears, each phone so much likelier than any other as `clear` says, natural logarithm."""
    phones = [phone for word in said for phone in (*SAID[word][0], "")]
    log_posteriors = np.full((2 * len(phones), NONE + 1), -clear, np.float32)
    for k, phone in enumerate(phones):
        log_posteriors[2 * k : 2 * k + 2, PHONES.index(phone) if phone else NONE] = 0.0
    search = CtcSearch(GRAPH, SAID.__getitem__)
    return Hypotheses(log_posteriors, search, search.best(log_posteriors), nearest, speech_s)


def enrolled(words: tuple[str, ...], deficit: float, confidence: float) -> Recognised:
    """The sentence that is nearest to enrolled people's words."""
    spans = tuple(WordSpan(w, 3200 * k, 3200 * (k + 1), confidence, deficit) for k, w in enumerate(words))
    return Recognised(words, "anna, enrolled", 0, 6400, confidence, math.inf, spans)


def fused(found: Hypotheses) -> Fused:
    out = fuse(found)
    assert out is not None
    return out


def test_what_is_clearly_heard_is_right() -> None:
    found = fused(hypotheses("turn", "left"))
    assert found.words == LEFT
    assert found.probability > 0.8


def test_who_hears_the_same_makes_it_surer_and_who_hears_another_does_not() -> None:
    alone, doubtful = (fused(hypotheses("turn", "left", clear=clear)).probability for clear in (8.0, 1.2))
    agreed = fused(hypotheses("turn", "left", nearest=enrolled(LEFT, 0.2, 0.9)))
    disputed = fused(hypotheses("turn", "left", clear=1.2, nearest=enrolled(RIGHT, 0.2, 0.6)))
    assert (agreed.words, disputed.words) == (LEFT, LEFT)
    assert agreed.probability > alone
    assert disputed.probability == doubtful


def test_a_lead_says_less_of_a_short_sentence() -> None:
    """A short word that is none of the robots' is like none of the others either."""
    short, longer = hypotheses("left"), hypotheses("turn", "left")
    short = replace(short, search=(search := CtcSearch(graph_of(("left",)), SAID.__getitem__)))
    short = replace(short, by_phones=search.best(short.log_posteriors))
    assert short.lead(("left",)) == longer.lead(LEFT)
    assert evidence(short, ("left",))[4] < evidence(longer, LEFT)[4]


def test_the_surer_an_enrolled_sentence_the_more_it_counts() -> None:
    for confidence, words in ((0.999, RIGHT), (0.05, LEFT)):
        nearest = enrolled(RIGHT, 0.1, confidence)
        assert fused(hypotheses("turn", "left", clear=0.4, nearest=nearest)).words == words


def test_silence_around_a_sentence_makes_it_no_better() -> None:
    strange = hypotheses("turn", "left").log_posteriors
    strange[6:12, PHONES.index("AA")] = 0.4  # in a strange voice
    silence = np.full((40, NONE + 1), -8.0, np.float32)
    silence[:, NONE] = 0.0
    search, lost = CtcSearch(GRAPH, SAID.__getitem__), []
    for heard in (strange, np.concatenate([silence, strange, silence])):
        found = Hypotheses(heard, search, search.best(heard), None, 0.7)
        lost.append(evidence(found, LEFT)[1])
    assert lost[0] > 0.0
    assert lost[1] == pytest.approx(lost[0])


def test_few_words_do_not_take_long() -> None:
    quick, slow = (fused(hypotheses("turn", "left", clear=2.0, speech_s=s)).probability for s in (0.7, 4.0))
    assert slow < quick


def test_what_no_row_of_phones_explains_is_unlikely() -> None:
    noise = hypotheses("turn", "left")
    log_posteriors = np.log(np.random.default_rng(3).dirichlet(np.full(NONE + 1, 0.05), 60) + 1e-6).astype(np.float32)
    found = Hypotheses(log_posteriors, noise.search, noise.search.best(log_posteriors), None, 1.2)
    assert fused(found).probability < 0.1


def test_a_sentence_that_cannot_be_loses_no_more_than_most() -> None:
    short = hypotheses("turn", "left")
    brief = Hypotheses(short.log_posteriors[:3], short.search, None, enrolled(RIGHT, 0.2, 0.9), 0.1)
    assert brief.loss(RIGHT) == MOST_LOSS
    assert len(brief.spans(RIGHT)) == 2
    assert fused(brief).words == RIGHT


def test_whoever_is_to_halt_it_is_a_call() -> None:
    said = {**SAID, "stop": [("S", "T", "AA", "P")], "rob": [("R", "AA", "B")], "all": [("AO", "L")]}
    arcs = (Arc(0, 1, "rob"), Arc(0, 1, "all"), Arc(1, 2, "stop"), Arc(0, 3, "turn"), Arc(3, 2, "left"))
    search = CtcSearch(WordGraph(4, arcs, 0, frozenset((2,)), frozenset()), said.__getitem__)
    log_posteriors = np.full((12, NONE + 1), -8.0, np.float32)
    for k, phone in enumerate(("AO", "L", "S", "T", "AA", "P")):
        log_posteriors[2 * k : 2 * k + 2, PHONES.index(phone)] = 0.0
    alone = Hypotheses(log_posteriors, search, search.best(log_posteriors), None, 0.7)
    same, other, else_ = (
        fused(replace(alone, nearest=enrolled(words, 2.0, 0.5))) for words in (("all", "stop"), ("rob", "stop"), LEFT)
    )
    assert {same.words, other.words, else_.words} == {("all", "stop")}
    assert same.probability == other.probability > else_.probability


def test_nothing_heard_is_no_sentence() -> None:
    heard = hypotheses("turn", "left")
    assert fuse(Hypotheses(heard.log_posteriors[:0], heard.search, None, None, 0.0)) is None
