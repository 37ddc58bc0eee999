"""The phone net learns a voice by sentences whose words are known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import pytest

from hvcpd.control.enrol.recordings import check_sentence
from hvcpd.language.graph import Arc, WordGraph, graph_of
from hvcpd.people.enrolled import STRANGER, Person, SpokenSentence
from hvcpd.people.phones import PHONES, CtcSearch, OutputLayer, far_net, net_inputs, nets
from hvcpd.people.second_pass import SecondPassRecogniser
from hvcpd.people.speaker_adaptation import BLANK, adapted_layers, alignment
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.stages import Segment
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import Voice

ELF = Voice("elf", 380.0, 1.75, 0.8, -24.0, 0.6, 3000.0)
"""Unlike all that the net has learned from."""
KNOWN = (
    "hi rob i am anna move forward five metres",
    "hi rob i am anna complete task seven",
    "hi rob i am anna report",
    "hi rob i am anna what are you doing",
    "hi rob i am anna say again slowly",
)
LEXICON = Lexicon.load()


@lru_cache
def recording(text: str, noise_rms: float = 1e-4) -> Samples:
    sound = Speaker(ELF, LEXICON).render([text.split()])
    padded = np.pad(sound, SAMPLE_RATE_HZ // 2)
    return np.asarray(padded + noise_rms * np.random.default_rng(3).standard_normal(len(padded)), np.float32)


def segment(text: str, noise_rms: float = 1e-4) -> Segment:
    lead, sound = SAMPLE_RATE_HZ // 2, recording(text, noise_rms)
    return Segment(sound, lead, lead, len(sound) - lead)


def sentence(text: str) -> SpokenSentence:
    return SpokenSentence(tuple(text.split()), net_inputs(segment(text)))


def losses(text: str, adapted: Sequence[OutputLayer]) -> tuple[float, float]:
    """Of a sentence by both nets' layers for anybody, and by the adapted ones."""
    before = after = 0.0
    search = CtcSearch(graph_of(text.split()), LEXICON.sounds)
    for net, layer in zip(nets(), adapted, strict=True):
        activations = net.activations(sentence(text).logs)
        both = [search.best(each.log_posteriors(activations)) for each in (net.layer, layer)]
        assert both[0] is not None
        assert both[1] is not None
        before, after = before + both[0].loss, after + both[1].loss
    return before, after


def test_sentences_of_a_voice_make_others_likelier() -> None:
    adapted = adapted_layers([sentence(each) for each in KNOWN], LEXICON.sounds)
    both = [losses(text, adapted) for text in ("hi all i am anna what is left", "bot turn left", "complete task two")]
    before, after = map(sum, zip(*both, strict=True))
    assert after < before


def test_without_sentences_nothing_is_adapted() -> None:
    assert adapted_layers([], LEXICON.sounds) == ()
    too_short = SpokenSentence(tuple(KNOWN[0].split()), sentence(KNOWN[0]).logs[:20])
    assert adapted_layers([too_short], LEXICON.sounds) == ()


def test_an_alignment_has_the_phones_of_the_words_in_order() -> None:
    words = KNOWN[2].split()
    found = alignment(far_net().log_posteriors(sentence(KNOWN[2]).logs), words, LEXICON.sounds)
    assert found is not None
    changes = [
        int(phone) for before, phone in zip([BLANK, *found], found, strict=False) if phone not in (BLANK, before)
    ]
    said = [PHONES.index(phone) for word in words for phone in LEXICON.sounds(word)[0]]
    assert changes == said


def test_a_phone_said_twice_has_a_gap_within() -> None:
    words = ["team", "my"]  # its M ends one word and begins the next
    log_posteriors = np.full((12, len(PHONES) + 1), -9.0, np.float32)
    for frame, phone in enumerate("T T IY IY M M M M AY AY AY".split()):
        log_posteriors[frame, PHONES.index(phone)] = 0.0
    log_posteriors[11, BLANK] = 0.0
    found = alignment(log_posteriors, words, {"team": [("T", "IY", "M")], "my": [("M", "AY")]}.__getitem__)
    assert found is not None
    m = PHONES.index("M")
    assert np.count_nonzero(np.diff((found == m).astype(int)) == 1) >= 1
    assert set(found) <= {*(PHONES.index(p) for p in ("T", "IY", "M", "AY")), BLANK}


def test_who_enrolled_by_sentences_is_understood_better() -> None:
    text = "hi all i am anna complete task two"
    anna = Person("Anna", sentences=tuple(map(sentence, KNOWN)))
    graph, said = graph_of(text.split()), segment(text, 0.03)
    alone = SecondPassRecogniser(graph, LEXICON, {}, True).compared(said)[0]
    known = SecondPassRecogniser(graph, LEXICON, {"anna": anna}, True).compared(said)[0]
    assert alone is not None
    assert known is not None
    assert known.spans[0].confidence > alone.spans[0].confidence
    assert known.voice == anna.voice == STRANGER  # a layer says nothing about who speaks


def test_where_the_layers_disagree_nothing_is_sure() -> None:
    graph = WordGraph(2, tuple(Arc(0, 1, word) for word in ("seven", "eleven")), 0, frozenset((1,)), frozenset())
    said = "seven"
    as_if = SpokenSentence(("eleven",), sentence(said).logs)  # enrolled with the wrong word, time and again
    liar = Person("Eve", sentences=(as_if,) * 20)
    alone = SecondPassRecogniser(graph, LEXICON, {}, True).compared(segment(said))[0]
    known = SecondPassRecogniser(graph, LEXICON, {"eve": liar}, True).compared(segment(said))[0]
    assert alone is not None
    assert known is not None
    assert known.words == alone.words
    assert known.confidence == 0.0 < alone.confidence


@pytest.mark.parametrize(
    ("sound", "why"),
    [
        (lambda: np.zeros(8000, np.float32), "nothing is to be heard"),
        (lambda: recording(KNOWN[1]), "that was not the sentence"),
        (lambda: np.clip(40.0 * recording(KNOWN[0]), -1.0, 1.0), "too loud for the microphone"),
        (lambda: recording(KNOWN[0], 0.06), "the room is too loud"),
        (lambda: np.concatenate([recording(KNOWN[0])] * 4), "it takes too long"),
    ],
)
def test_what_is_not_the_sentence_is_refused_with_the_reason(sound: Callable[[], Samples], why: str) -> None:
    found, fault = check_sentence(sound(), tuple(KNOWN[0].split()), LEXICON.sounds)
    assert found is None
    assert why in fault


def test_what_is_the_sentence_is_taken() -> None:
    found, fault = check_sentence(recording(KNOWN[0]), tuple(KNOWN[0].split()), LEXICON.sounds)
    assert fault == ""
    assert found is not None
    assert found.words == tuple(KNOWN[0].split())
