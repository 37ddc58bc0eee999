"""What robots' voices say, as listeners by waveform need it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.rendered_waveforms import KEPT, WaveformBook, WaveformCache
from hvcpd.recognition.channel.path import thirds_of
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.recorded import RecordedSpeaker
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import UnitCache
from hvcpd.synthesis.voices import VOICES

LEXICON = Lexicon.load()
PHRASES = (("hi", "rob"), ("i", "am", "bot"), ("water", "the", "yellow", "rose"))
WORDS = {word for phrase in PHRASES for word in phrase}


@pytest.fixture(scope="module")
def speaker(tmp_path_factory: pytest.TempPathFactory) -> Speaker:
    return Speaker(VOICES[0], LEXICON, UnitCache(tmp_path_factory.mktemp("units")))


def test_a_sentence_is_the_sum_of_what_is_said(speaker: Speaker) -> None:
    book = WaveformBook("oak", speaker, WORDS)
    said = [(word, number == len(phrase) - 1) for phrase in PHRASES for number, word in enumerate(phrase)]
    rendered = speaker.render(PHRASES)
    made = np.zeros(len(rendered), np.float32)
    at, paused = 0, True
    for (word, final), third in zip(said, thirds_of(len(said)), strict=True):
        [way] = [way for way in book.renderings(word, third) if way.final == final]
        at = max(at - way.lead * paused, 0)
        made[at : at + len(way.samples)] += way.samples
        at, paused = at + way.advance, final
    gain = float(rendered @ made / (made @ made))
    assert np.allclose(rendered, gain * made, atol=2e-4)


def test_what_counts_as_a_word_is_said_as_the_word_that_it_is(speaker: Speaker) -> None:
    book = WaveformBook("oak", speaker, WORDS, phrases={"rose": [("basket",)]})
    rose, basket = (WaveformBook("oak", speaker, (word,)).renderings(word, 1) for word in ("rose", "basket"))
    assert [way.samples.tolist() for way in book.renderings("rose", 1)] == [
        way.samples.tolist() for way in (*rose, *basket)
    ]
    assert [way.final for way in book.renderings("rose", 1)] == [way.final for way in (*rose, *basket)]
    assert book.renderings("basket", 1) == ()


def test_other_words_are_not_said(speaker: Speaker) -> None:
    assert WaveformBook("oak", speaker, WORDS).renderings("lily", 0) == ()


def test_memory_is_bounded_and_can_be_given_back(speaker: Speaker) -> None:
    words = [word for word in LEXICON.entries if word.isalpha()][: KEPT + 5]
    silent = RecordedSpeaker({word: np.ones(400, np.float32) for word in ()}, LEXICON)
    cache = WaveformCache()
    book, other = WaveformBook("oak", silent, words, cache), WaveformBook("elm", silent, words, cache)
    for word in words:
        assert book.renderings(word, 0) == ()
    assert cache.units.cache_info().currsize == KEPT
    other.renderings(words[0], 0)
    assert cache.units.cache_info().currsize == KEPT
    book.free_memory()
    assert cache.units.cache_info().currsize == 0


def test_recorded_words_are_said_at_every_pitch() -> None:
    hum = np.asarray(0.3 * np.sin(np.arange(8000) / 9.0) * np.hanning(8000), np.float32)
    book = WaveformBook("oak", RecordedSpeaker({"stop": hum}, LEXICON), ("stop",))
    ways = [book.renderings("stop", third) for third in (0, 1, 2)]
    assert [[way.final for way in each] for each in ways] == [[False, True]] * 3
    assert all(np.array_equal(each[1].samples, ways[0][1].samples) for each in ways)


def test_preparing_fills_the_cache_until_it_is_told_to_end(tmp_path: Path) -> None:
    speaker = Speaker(VOICES[1], LEXICON, UnitCache(tmp_path))
    WaveformBook("oak", speaker, ("hi",)).prepare(lambda: False)
    assert not list(tmp_path.iterdir())
    WaveformBook("oak", speaker, ("hi",)).prepare(lambda: True)
    assert len(list(tmp_path.iterdir())) == 6


def test_preparing_keeps_no_waveforms(tmp_path: Path) -> None:
    waveforms = WaveformCache()
    book = WaveformBook("oak", Speaker(VOICES[1], LEXICON, UnitCache(tmp_path)), ("hi",), waveforms)
    book.prepare(lambda: True)
    assert waveforms.units.cache_info().currsize == 0
    assert book.renderings.cache_info().currsize == 3
