"""The hearing benchmark's own arithmetic: who is right, how sure that is, how far, and what the noises are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.hearing import mixing
from benchmarks.hearing.distance import range_m
from benchmarks.hearing.material import Spoken, make_stream, make_team
from benchmarks.hearing.noises import KINDS, make_noise
from benchmarks.hearing.scoring import Outcome, Score, judge_events
from benchmarks.hearing.table import Result, joined, read_csv, write_csv
from hil_fakes import transducers
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Event, Garbled, Recognised, Urgent

FIRST, SECOND = Spoken(("hi", "rob"), 1000, 2000), Spoken(("all", "stop"), 5000, 6000)


def told(words: str, start: int, end: int) -> Recognised:
    return Recognised(tuple(words.split()), "oak", start, end, 0.9, 10.0, ())


@pytest.mark.parametrize(
    ("events", "outcomes", "made_up"),
    [
        ([], [Outcome.MISSED, Outcome.MISSED], 0),
        ([told("hi rob", 1010, 1990), Garbled(5000, 5500)], [Outcome.RIGHT, Outcome.GARBLED], 0),
        ([told("hi bot", 1010, 1990), told("all stop", 5000, 6100)], [Outcome.WRONG, Outcome.RIGHT], 0),
        ([told("hi rob", 2500, 3500), Urgent(3000, 3500)], [Outcome.MISSED, Outcome.MISSED], 2),
        ([Urgent(1200, 1500), Urgent(5500, 5900)], [Outcome.WRONG, Outcome.GARBLED], 0),
        ([Garbled(1000, 1500), told("hi rob", 1010, 1990)], [Outcome.RIGHT, Outcome.MISSED], 0),
    ],
)
def test_reports_are_judged_by_what_was_said_there(events: list[Event], outcomes: list[Outcome], made_up: int) -> None:
    score = judge_events([(event.end_sample + 400, event) for event in events], [FIRST, SECOND])
    assert score.outcomes == outcomes
    assert score.made_up == made_up
    assert len(score.notes) == made_up + sum(o is not Outcome.RIGHT for o in outcomes)


def test_a_repeated_sentence_is_judged_by_the_first_time_that_it_is_understood() -> None:
    times = [Spoken(("hi", "rob"), at, at + 1000, number=0) for at in (1000, 5000, 9000)]
    late = judge_events([(9900, told("hi rob", 5000, 6000)), (9999, told("hi bot", 9000, 9900))], times)
    assert late.outcomes == [Outcome.RIGHT]
    wrong = judge_events([(2000, told("hi bot", 1000, 1900)), (6000, told("hi rob", 5000, 6000))], times)
    assert wrong.outcomes == [Outcome.WRONG]


def test_a_table_is_read_as_it_was_written_and_what_is_measured_again_replaced(tmp_path: Path) -> None:
    ours, theirs = Score(made_up=2, delays_s=[0.3], seconds=1.0, heard_s=20.0), Score()
    for outcome, times in ((Outcome.RIGHT, 7), (Outcome.WRONG, 1), (Outcome.GARBLED, 2), (Outcome.MISSED, 3)):
        ours.outcomes += [outcome] * times
    theirs.outcomes += [Outcome.MISSED] * 13
    first = Result("noise", "pink", -5.0, "pink noise, SNR -5 dB", ours, theirs)
    second = Result("clock", "clock", 200.0, "clock", ours, None)
    path = tmp_path / "table.csv"
    assert read_csv(path) == []
    write_csv(path, [first, second])
    text = path.read_text()
    write_csv(path, read_csv(path))
    assert path.read_text() == text
    assert [r.peer is None for r in read_csv(path)] == [False, True]
    again = Result("noise", "pink", -5.0, "again", theirs, None)
    assert [r.label for r in joined(read_csv(path), [again])] == ["clock", "again"]


@given(st.floats(0.5, 0.94), st.floats(0.96, 1.0))
def test_the_range_is_where_the_share_falls_below_95_percent(after: float, before: float) -> None:
    sign, far_m = range_m([(1.0, 1.0), (2.0, before), (4.0, after), (8.0, 1.0)])
    assert sign == ""
    assert 2.0 < far_m < 4.0


def test_a_range_beyond_what_was_measured_is_a_bound() -> None:
    assert range_m([(1.0, 1.0), (2.0, 0.96)]) == (">", 2.0)
    assert range_m([(1.0, 0.9), (2.0, 0.8)]) == ("<", 1.0)


def test_streams_and_noises_are_what_they_say_and_the_same_again() -> None:
    team = make_team(("Rob", "Bot"))
    clean, spoken = make_stream(team.book, team.speakers(), 2, seed=3)
    again, _ = make_stream(team.book, team.speakers(), 2, seed=3)
    assert (clean == again).all()
    for kind in KINDS:
        noise = make_noise(kind, len(clean), 5, team)
        assert len(noise) == len(clean)
        assert np.sqrt(np.mean(noise**2)) == pytest.approx(1.0, abs=0.05)
        assert (noise == make_noise(kind, len(clean), 5, team)).all()
        mixed = mixing.mix(clean, spoken, noise, snr_db=-10.0, level_dbfs=-35.0)
        assert np.sqrt(np.mean(mixed**2)) == pytest.approx(10.0 ** (-25.0 / 20.0), rel=0.15)
    with pytest.raises(ValueError, match="brown"):
        make_noise("brown", 100, 1, team)


def test_a_clock_that_is_off_moves_the_end_and_the_truth_with_it() -> None:
    team = make_team(("Rob", "Bot"))
    clean, spoken = make_stream(team.book, team.speakers(), 3, seed=4)
    moved, truth = mixing.off_clock(clean, spoken, 2000.0)
    assert len(clean) - len(moved) == pytest.approx(0.002 * len(clean), abs=2)
    for before, after in zip(spoken, truth, strict=True):
        was = np.sqrt(np.mean(clean[before.start : before.end] ** 2))
        assert np.sqrt(np.mean(moved[after.start : after.end] ** 2)) == pytest.approx(float(was), rel=0.02)


def test_a_small_loudspeaker_and_a_tilt_change_the_spectrum_as_they_say() -> None:
    tone = {hz: np.sin(2 * np.pi * hz * np.arange(SAMPLE_RATE_HZ) / SAMPLE_RATE_HZ) for hz in (150, 1000, 2000)}

    def level_db(sound: np.ndarray) -> float:
        return float(10 * np.log10(2.0 * np.mean(sound[4000:12000] ** 2)))

    assert level_db(transducers.band(tone[150].astype(np.float32), 300.0, 6000.0)) == pytest.approx(-12.3, abs=0.3)
    assert level_db(transducers.band(tone[1000].astype(np.float32), 300.0, 6000.0)) == pytest.approx(0.0, abs=0.3)
    assert level_db(transducers.tilt(tone[2000].astype(np.float32), 3.0)) == pytest.approx(3.0, abs=0.2)
