"""What sentences begin with is sought where it may be, and nowhere else."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from hvcpd.ports import Samples
from hvcpd.recognition.matched_filter import WhitenedSound
from hvcpd.recognition.onset_search import LONGEST_WAIT, SIZE, STEP, First, OnsetSchedule
from tests.recognition.hisses import BOOKS

HI, STOP = (First(BOOKS["oak"], word, 1, BOOKS["oak"].said(word, 0)[0]) for word in ("hi", "stop"))
CHUNK = STEP // 4
BEFORE = 40 * CHUNK
"""Samples of noise alone, from which the noise is known."""

KNOWN = [True, False]
"""What is made at first: the greetings, and once all others, to know how voices that begin with them sound."""


class Hearing:
    """Seeks in a sound chunk by chunk."""

    def __init__(self, *sounds: tuple[int, Samples]) -> None:
        """Each sound that many samples after the noise is known."""
        self.sound = WhitenedSound()
        self.made: list[bool] = []
        self.beginnings = OnsetSchedule(self._make)
        self._samples = np.asarray(0.1 * np.random.default_rng(5).standard_normal(BEFORE + 60 * CHUNK), np.float32)
        for at, sound in sounds:
            self._samples[BEFORE + at :][: len(sound)] += sound
        list(self.seek(BEFORE // CHUNK, signs=False))

    def _make(self, greetings: bool) -> list[First]:
        self.made.append(greetings)
        return [HI if greetings else STOP]

    def seek(
        self, n_chunks: int, signs: bool, greeted: bool = False, settled: bool = False
    ) -> Iterator[tuple[str, int]]:
        for _ in range(n_chunks):
            self.sound.push(self._samples[self.sound.end :][:CHUNK])
            if self.sound.end == BEFORE:
                self.beginnings.restart(BEFORE)
            if self.sound.whitening.ready:
                for first, at in self.beginnings.seek(self.sound, signs, greeted, settled):
                    yield first.word, at - BEFORE


def test_other_beginnings_may_come_to_be_known_meanwhile() -> None:
    """Another thread prepares the peers' voices, and renews whenever one is ready."""
    hearing = Hearing((3000, HI.said.samples))

    def make(greetings: bool) -> list[First]:
        if not greetings:
            hearing.beginnings.renew()
        return [HI if greetings else STOP]

    hearing.beginnings = OnsetSchedule(make)
    hearing.beginnings.restart(BEFORE)
    assert list(hearing.seek(30, signs=True)) == [("hi", 3000)]


def test_without_signs_of_speech_only_greetings_are_sought() -> None:
    hearing = Hearing((3000, HI.said.samples), (20_000, STOP.said.samples))
    assert list(hearing.seek(30, signs=False)) == [("hi", 3000)]
    assert hearing.made == KNOWN


def test_what_began_before_the_signs_is_found() -> None:
    hearing = Hearing((3000, STOP.said.samples))
    assert list(hearing.seek(12, signs=False)) == []
    assert list(hearing.seek(10, signs=True)) == [("stop", 3000)]


def test_of_a_sign_that_is_soon_over_what_began_before_it_is_found_too() -> None:
    hearing = Hearing((3000, STOP.said.samples))
    assert list(hearing.seek(12, signs=False)) == []
    assert list(hearing.seek(1, signs=True)) == []
    assert list(hearing.seek(9, signs=False)) == [("stop", 3000)]


def test_while_a_greeting_is_followed_the_others_wait() -> None:
    hearing = Hearing((3000, STOP.said.samples))
    assert list(hearing.seek(LONGEST_WAIT * 4, signs=True, greeted=True)) == []
    assert hearing.made == KNOWN
    assert list(hearing.seek(4, signs=True)) == [("stop", 3000)]


def test_in_a_sentence_nothing_is_sought_not_even_later() -> None:
    hearing = Hearing((3000, STOP.said.samples), (6000, HI.said.samples))
    assert list(hearing.seek(20, signs=True, settled=True)) == []
    assert list(hearing.seek(20, signs=True)) == []


@pytest.mark.parametrize("word", [HI, STOP])
def test_the_place_is_the_same_however_late_it_is_sought(word: First) -> None:
    hearing = Hearing((SIZE, word.said.samples))
    assert list(hearing.seek(40, signs=True)) == [(word.word, SIZE)]
