"""When a stretch of sound in which somebody seems to speak is searched."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hvcpd.recognition.channel.endpoints import CLATTER, CUT_AFTER, CUT_AGAIN_AFTER, Onset, OpenSegment
from hvcpd.recognition.channel.path import Path
from hvcpd.recognition.channel.search import SearchResult
from hvcpd.recognition.stages import QUIET
from tests.recognition.hisses import BOOKS

GREETING = Onset(0, greeting=True)


def stretch(continues: bool = False) -> OpenSegment:
    return OpenSegment(0, 0, CUT_AGAIN_AFTER, end_hidden=True, continues=continues)


@pytest.mark.parametrize("since", [None, 9_000])
def test_another_greeting_does_not_delay_the_search_for_a_sentence_in_progress(since: int | None) -> None:
    follows = stretch(continues=True)
    follows.note_onset(GREETING, 10_000, 6_000, since)
    assert (follows.cut_at, follows.end_hidden) == (CUT_AGAIN_AFTER, True)


def test_signs_that_begin_with_a_greeting_show_the_end_and_others_do_not() -> None:
    shown, hidden = stretch(), stretch()
    shown.note_onset(GREETING, 10_000, 6_000, 9_000)
    hidden.note_onset(GREETING, 40_000, 36_000, 9_000)
    assert (shown.cut_at, hidden.cut_at) == (10_000 + CLATTER, 40_000 + CUT_AFTER)
    assert shown.is_over(QUIET)
    assert not hidden.is_over(QUIET)


def test_a_voice_that_stands_out_shows_its_end_in_any_noise() -> None:
    loud, faint = stretch(), stretch()
    for at in range(0, 32_000, 400):
        loud.note_sign(at, at + 400)
        if at % 1_600 == 0:
            faint.note_sign(at, at + 400)
    assert loud.is_over(32_000 + QUIET)
    assert not faint.is_over(32_000 + QUIET)


def test_what_goes_on_is_searched_again_from_its_first_beginning_whatever_path_is_best() -> None:
    ended, before = stretch(), Path.empty(BOOKS["oak"], 0)
    assert not ended.in_progress
    ended.result = SearchResult(in_progress=(replace(before, starts=(30_000,)), replace(before, starts=(9_000,))))
    assert ended.first_start == 9_000
