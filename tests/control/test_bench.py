"""`hvcpctl bench`: its table, its verdict, and a piece of work that fails."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hvcpd.control.bench.bench import ROWS, BenchError, Cost, run, seconds, table
from hvcpd.control.bench.work import WORKS
from hvcpd.control.cli import make_parser


class Counting:
    """Measures work by its amount: seven before it, ninety more the first time, and two for each."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, int]] = []

    def __call__(self, work: str, _: Path, amount: int) -> Cost:
        rendering = 0.0 if any(before == work for before, _ in self.asked) else 90.0
        self.asked.append((work, amount))
        return Cost(7.0 + rendering + 2.0 * amount, 0.5)


def test_what_precedes_the_work_is_taken_off_but_at_starts(tmp_path: Path) -> None:
    counting = Counting()
    figures = list(table(counting, tmp_path))
    assert [row for row, _ in figures] == list(ROWS)
    for row, cost in figures:
        if row.alone:
            assert cost.amount == pytest.approx(2.0 * row.amount * row.times)
    assert [cost.amount for row, cost in figures if not row.alone] == [99.0, 9.0]
    assert {row.work for row in ROWS} == set(WORKS)


def test_a_figure_is_shown_with_its_unit(capsys: pytest.CaptureFixture[str]) -> None:
    run(make_parser().parse_args(["bench"]), Counting())
    assert capsys.readouterr().out.splitlines()[-2].split()[-5:] == ["200.00", "%", "of", "a", "core"]
    run(make_parser().parse_args(["bench", "--json"]), Counting())
    assert json.loads(capsys.readouterr().out.splitlines()[-2]) == {
        "what": ROWS[-1].text,
        "value": 200.0,
        "unit": "% of a core",
        "busiest": 0.5,
    }


def test_rendering_is_done_in_a_process_of_its_own(tmp_path: Path) -> None:
    assert seconds("waveforms", tmp_path, 1).amount > 0.0


def test_a_work_that_fails_says_why(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("no folder")
    with pytest.raises(BenchError, match=r"say: .*File exists"):
        seconds("say", tmp_path, 0)
