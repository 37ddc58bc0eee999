"""A sentence is heard as it was said, or not at all, whatever silence is around it: a seeded part of
`benchmarks.silence`."""

from __future__ import annotations

import pytest

from benchmarks.silence import Case, verdict

NAMES = ("Rob", "Bot")
WHAT_IS_LEFT = 42


@pytest.mark.slow
@pytest.mark.parametrize(
    ("voice", "form", "lead_s", "tail_s"),
    [
        ("cedar", 48, 1.0, 1.0),  # "Team plant, turn left", once heard as "Turn left"
        ("granite", 36, 0.0, 1.0),  # "Hi all, I am Rob, report, I am free, …", once "Rob, report"
        ("lark", 37, 1.0, 1.0),
        ("wren", 45, 0.0, 0.0),  # "Come back", once lost
        ("rose", 24, 1.0, 1.0),  # "…, member of team plant, resume", once two sentences
        ("brook", 45, 1.0, 0.0),
    ],
)
def test_a_sentence_amid_digital_silence_is_heard_as_it_was_said(
    voice: str, form: int, lead_s: float, tail_s: float
) -> None:
    _, result, told = verdict(Case(voice, form, "zeros", lead_s, tail_s, NAMES, 0))
    assert result == "right", told


@pytest.mark.slow
@pytest.mark.parametrize("bed", ["lsb", "noise", "offset"])
def test_a_recording_that_begins_with_the_sentence_is_heard(bed: str) -> None:
    _, result, told = verdict(Case("wren", 45, bed, 0.0, 0.0, NAMES, 0))
    assert result == "right", told


@pytest.mark.slow
@pytest.mark.parametrize("lead_s", [0.0, 0.1, 0.36, 0.5, 1.0])
def test_no_question_becomes_a_motion(lead_s: float) -> None:
    """ "What is left" was once heard as "Turn left", as sure as can be."""
    _, result, told = verdict(Case("brook", WHAT_IS_LEFT, "zeros", lead_s, 0.0, NAMES, 0))
    assert result == "right", told
