"""Which of two listeners is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hvcpd.assembly.rendered_waveforms import SpokenBook
from hvcpd.recognition.agreement import Agreement
from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.events import Event, Garbled, Recognised, WordSpan
from hvcpd.recognition.paths import Coherent, HeardWord, Path
from hvcpd.recognition.recogniser import Recogniser
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES
from tests.recognition.signals import graph, in_noise, sentence, templates


class Follows(CoherentListener):
    """Follows what it is told to."""

    def __init__(self) -> None:
        super().__init__(graph(), ())
        self.path: Path | None = None
        self.dismissed = 0

    @property
    def follows(self) -> Path | None:
        return self.path

    def dismiss(self, end: int, voice: str | None = None) -> None:
        self.dismissed = end
        self.path = None


def followed(words: str) -> Path:
    return Path(SpokenBook("oak", Speaker(VOICES[0], Lexicon({})), ()), 1, 9000, words=tuple(words.split()))


def recognised(*words: str, start: int = 1000, end: int = 9000) -> Recognised:
    spans = tuple(WordSpan(word, start, end, 0.9) for word in words)
    return Recognised(words, "oak", start, end, 0.9, 3.0, spans)


def heard(*words: str, start: int = 1000, end: int = 9000, margin: float = 50.0) -> Coherent:
    return Coherent(tuple(HeardWord(word, start, end, 1.0, margin) for word in words), "oak", 500.0)


def settled(agreement: Agreement, events: list[Event], *sentences: Coherent, since: int = 0) -> list[Event]:
    def describe(sentence: Coherent) -> Recognised:
        first, last = sentence.words[0], sentence.words[-1]
        return recognised(*(word.word for word in sentence.words), start=first.start, end=last.end)

    return agreement.settle(events, sentences, since, describe)[0]


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
    listener = Follows()
    agreement = Agreement(listener)
    assert settled(agreement, [], heard("rob", margin=margin), since=since) == []
    assert settled(agreement, [recognised("bot")]) == [recognised("bot")]
    assert listener.dismissed == 9000


def test_what_was_cut_short_is_not_whole_because_the_network_thinks_so() -> None:
    for words, told in ((("hi", "rob"), Garbled(1000, 9000)), (("hi", "bot"), recognised("hi", "bot"))):
        agreement = Agreement(Follows())
        assert settled(agreement, [], replace(heard("hi", "rob"), cut=True)) == []
        assert settled(agreement, [recognised(*words)]) == [told]


@pytest.mark.parametrize(("said", "becomes"), [("hi rob, stop", "hi rob stop"), ("rob, rob, rob", "garbled")])
def test_nothing_is_concluded_while_a_sentence_is_followed(said: str, becomes: str) -> None:
    listener = Follows()
    ears = Recogniser(graph(), templates(), coherent=listener)
    sound = in_noise(np.pad(sentence(said), (0, 16_000)), before_s=1.0, after_s=0.1)
    assert ears.push(sound[:16_000]) == []
    listener.path = followed("hi rob")
    assert ears.push(sound[16_000:-1600]) == []
    listener.path = None
    told = ears.push(sound[-1600:])
    assert [" ".join(e.words) if isinstance(e, Recognised) else "garbled" for e in told] == [becomes]
