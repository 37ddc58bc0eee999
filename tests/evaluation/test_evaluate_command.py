"""`hvcpctl evaluate` as a person runs it."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from hvcpd.control.cli import main
from hvcpd.evaluation.experiments import NAMES, experiment
from hvcpd.evaluation.report import write_findings, write_page
from hvcpd.evaluation.trials import Comparison, Findings, Table
from hvcpd.synthesis.explain import PAPER_TABLE


def test_the_papers_first_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "pronunciation", "--jobs", "1", "--trials", "1", "--out", str(tmp_path)]) == 0
    with (tmp_path / "pronunciation.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["word"] for row in rows] == list(PAPER_TABLE)
    read = rows[0]
    assert (read["paper"], read["alone"], read["past"]) == ("r-eed", "reed", "rehd")
    page = (tmp_path / "report.html").read_text()
    assert "r-eed" in page
    assert "Seed 1, 1 trial a step" in page
    assert "http" not in page.replace("http://www.w3.org", "").replace("http-equiv", "")
    kept = [json.loads(line) for line in (tmp_path / "pronunciation.rows.jsonl").read_text().splitlines()]
    assert len(kept) == len(PAPER_TABLE)
    told = capsys.readouterr()
    assert f"{tmp_path / 'report.html'}; beside it a CSV of each experiment, and the rows of all trials.\n" in told.out
    assert "matplotlib" not in told.err, "there is nothing to draw"


@pytest.mark.parametrize(
    "arguments", [["nonsense"], ["wake", "--trials", "0"], ["wake", "--jobs", "many"], ["wake", "--seed", "-1"]]
)
def test_wrong_arguments_are_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        main(["evaluate", *arguments])
    assert exit_.value.code == 2
    assert "evaluate" in capsys.readouterr().err


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert main(["evaluate", "pronunciation", "--jobs", "1", "--out", str(tmp_path / "file" / "x")]) == 2
    assert capsys.readouterr().err.endswith("name another directory\n")


@pytest.mark.parametrize("name", NAMES)
def test_every_experiment_is_there(name: str) -> None:
    assert experiment(name).name == name


def test_what_was_found_is_no_markup(tmp_path: Path) -> None:
    found = Findings("<script>", ("a & b",), Table(("x",), (("<b>",),)), assumptions=("<i>",))
    write_findings("one", found, tmp_path)
    page = write_page([("one", found)], "about", tmp_path).read_text()
    assert "<script>" not in page
    assert "&lt;b&gt;" in page
    assert (tmp_path / "one.csv").read_text() == "x\n<b>\n"


def test_the_papers_figures_stand_beside_ours_at_the_head_of_the_report(tmp_path: Path) -> None:
    beside = Comparison("pivotal <distance>", "120 cm", "11.2 m")
    found = [
        (name, Findings(name, (), Table((), ()), beside=(beside,) if name == "one" else ()))
        for name in "one two".split()
    ]
    page = write_page(found, "about", tmp_path).read_text()
    assert page.count("120 cm") == 1
    head = page[: page.index("<h2>")]
    assert '<a href="#one">pivotal &lt;distance&gt;</a>' in head
    assert "11.2 m" in head


def test_plots_are_drawn_the_same_again_with_their_assumptions(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib, of the eval extra")
    texts: list[str] = []

    def draw(figure: Any) -> None:
        figure.add_subplot().plot([1, 2], [3, 4])

    def draw_and_look(figure: Any) -> None:
        draw(figure)
        figure.canvas.mpl_connect("draw_event", lambda _: texts.append(figure.get_supxlabel()))

    for name, drawing in (("a", draw), ("b", draw_and_look)):
        (tmp_path / name).mkdir()
        write_findings("x", Findings("t", (), Table((), ()), drawing, ("a hall of 24 m",)), tmp_path / name)
    assert (tmp_path / "a" / "x.svg").read_bytes() == (tmp_path / "b" / "x.svg").read_bytes()
    assert (tmp_path / "a" / "x.png").read_bytes().startswith(b"\x89PNG")
    assert any("Simulated:\na hall of 24 m" in text for text in texts)
