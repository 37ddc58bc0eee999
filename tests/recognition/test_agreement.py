"""Which of two listeners is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from hvcpd.assembly.rendered_waveforms import SpokenBook
from hvcpd.language.graph import Arc, WordGraph
from hvcpd.recognition.agreement import WAIT, Agreement
from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.events import Event, Garbled, Recognised, Urgent, WordSpan
from hvcpd.recognition.paths import Coherent, HeardWord, Path
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

BOOK = SpokenBook("oak", Speaker(VOICES[0], Lexicon({})), ())
GRAPH = WordGraph(2, (Arc(0, 1, "stop"),), 0, frozenset({1}), frozenset())


class Follows(CoherentListener):
    """Follows what it is told to."""

    def __init__(self) -> None:
        super().__init__(GRAPH, ())
        self.path: Path | None = None
        self.dismissed = 0

    @property
    def follows(self) -> Path | None:
        return self.path

    def dismiss(self, end: int) -> None:
        self.dismissed = end
        self.path = None


def followed(*words: str, start: int = 1000) -> Path:
    return Path(
        SpokenBook("oak", Speaker(VOICES[0], Lexicon({})), ()),
        1,
        9000,
        words=words,
        heard=200.0,
        known=200.0,
        start=start,
    )


def recognised(*words: str, start: int = 1000, end: int = 9000) -> Recognised:
    spans = tuple(WordSpan(word, start, end, 0.9) for word in words)
    return Recognised(words, "oak", start, end, 0.9, 3.0, spans)


def heard(*words: str, start: int = 1000, end: int = 9000, margin: float = 50.0) -> Coherent:
    return Coherent(tuple(HeardWord(word, start, end, 1.0, margin) for word in words), "oak", 500.0)


def settled(
    agreement: Agreement, events: list[Event], *sentences: Coherent, since: int = 0, now: int = 0
) -> list[Event]:
    def describe(sentence: Coherent) -> Recognised:
        first, last = sentence.words[0], sentence.words[-1]
        return recognised(*(word.word for word in sentence.words), start=first.start, end=last.end)

    return agreement.settle(events, sentences, since, now, describe)[0]


def test_each_is_told_where_the_other_heard_nothing() -> None:
    agreement = Agreement(Follows())
    assert settled(agreement, [recognised("stop")]) == [recognised("stop")]
    assert settled(agreement, [], heard("go", start=20_000, end=30_000)) == [recognised("go", start=20_000, end=30_000)]


def test_a_sentence_is_told_once_whoever_is_first() -> None:
    for first, second in ((0, 1), (1, 0)):
        agreement = Agreement(Follows())
        both: list[Callable[[Agreement], list[Event]]] = [
            lambda a: settled(a, [recognised("stop")]),
            lambda a: settled(a, [], heard("stop")),
        ]
        told = both[first](agreement) + (both[second](agreement) if first == 0 else [])
        assert told == [recognised("stop")]


def test_of_one_moment_the_waveform_is_believed() -> None:
    assert settled(Agreement(Follows()), [recognised("bot")], heard("rob")) == [recognised("rob")]
    assert settled(Agreement(Follows()), [Garbled(2000, 8000)], heard("rob")) == [recognised("rob")]


@pytest.mark.parametrize(("margin", "since"), [(1.0, 0), (50.0, 1001)])
def test_who_is_not_sure_leaves_it_to_the_network(margin: float, since: int) -> None:
    agreement = Agreement(Follows())
    assert settled(agreement, [], heard("rob", margin=margin), since=since) == []
    assert settled(agreement, [recognised("bot")], now=9000 + WAIT - 1) == [recognised("bot")]
    assert settled(agreement, [], now=9000 + WAIT) == []


def test_what_was_cut_short_is_not_whole_because_the_network_thinks_so() -> None:
    for words, told in ((("hi", "rob"), Garbled(1000, 9000)), (("hi", "bot"), recognised("hi", "bot"))):
        agreement = Agreement(Follows())
        assert settled(agreement, [], replace(heard("hi", "rob"), cut=True)) == []
        assert settled(agreement, [recognised(*words)]) == [told]


def test_who_is_not_sure_heard_garbled_in_the_end() -> None:
    agreement = Agreement(Follows())
    assert settled(agreement, [], heard("rob", margin=1.0)) == []
    assert settled(agreement, [], now=9000 + WAIT) == [Garbled(1000, 9000)]
    assert settled(agreement, [], now=9000 + 2 * WAIT) == []


def test_garbled_waits_while_a_sentence_is_followed() -> None:
    listener = Follows()
    listener.path = followed("hi", "rob")
    agreement = Agreement(listener)
    assert settled(agreement, [Garbled(2000, 8000)]) == []
    assert settled(agreement, []) == []
    assert settled(agreement, [], heard("hi", "rob")) == [recognised("hi", "rob")]
    listener.path = None
    assert settled(agreement, []) == []


def test_garbled_is_told_when_nothing_comes_of_it() -> None:
    listener = Follows()
    listener.path = followed("hi", "rob")
    agreement = Agreement(listener)
    settled(agreement, [Garbled(2000, 8000)])
    listener.path = None
    assert settled(agreement, []) == [Garbled(2000, 8000)]
    assert settled(agreement, []) == []


def test_a_sentence_cut_short_waits_for_its_end() -> None:
    listener = Follows()
    for likelihood, in_the_end in ((50.0, Garbled(1000, 9000)), (1.0, recognised("hi", "rob"))):
        listener.path = replace(followed("hi", "rob", "water"), parent=followed("hi", "rob"), likelihood=likelihood)
        agreement = Agreement(listener)
        assert settled(agreement, [recognised("hi", "rob")]) == []
        listener.path = None
        assert settled(agreement, []) == [in_the_end]


def test_a_sentence_that_is_followed_as_far_is_told_in_the_end() -> None:
    listener = Follows()
    listener.path = followed("hi", "rob")
    agreement = Agreement(listener)
    assert settled(agreement, [recognised("hi", "rob")]) == []
    listener.path = None
    assert settled(agreement, []) == [recognised("hi", "rob")]
    assert listener.dismissed == 9000


def test_of_two_that_contradict_the_one_is_told_that_gets_to_its_end() -> None:
    for sentences, in_the_end in (
        ([], recognised("hi", "rob", "water")),
        ([heard("hi", "bot")], recognised("hi", "bot")),
    ):
        listener = Follows()
        listener.path = followed("hi", "bot")
        agreement = Agreement(listener)
        assert settled(agreement, [recognised("hi", "rob", "water")]) == []
        listener.path = None
        assert settled(agreement, [], *sentences) == [in_the_end]


def test_the_network_is_believed_where_it_is_ahead() -> None:
    listener = Follows()
    listener.path = followed("hi", "rob")
    event = recognised("hi", "rob", "stop")
    assert settled(Agreement(listener), [event]) == [event]
    assert listener.dismissed == 9000


def test_stop_never_waits() -> None:
    listener = Follows()
    listener.path = followed("hi", "rob")
    assert settled(Agreement(listener), [Urgent(2000, 8000)]) == [Urgent(2000, 8000)]


def test_what_waits_is_told_at_an_interruption() -> None:
    listener = Follows()
    listener.path = followed("hi", "rob")
    agreement = Agreement(listener)
    settled(agreement, [Garbled(2000, 8000)])
    assert agreement.interrupt() == [Garbled(2000, 8000)]
    assert agreement.interrupt() == []
