"""The report of a shift, from a transcript."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path

import pytest

from hvcpd.control import report
from hvcpd.control.cli import make_parser
from hvcpd.errors import ConfigError
from hvcpd.reporting.shift import BINS, SAME_REPORT_S, Shift, read_shift
from hvcpd.reporting.shift_page import as_text, page
from hvcpd.store import Store, TranscriptRecord, TranscriptRow
from tests.coordination.mission import Mission, plants

BEGIN_S = 1_790_000_000.0
HOUR_S = 3600.0
BOOK = Mission(("Rob", "Bot"), plants(3), ("Anna",)).book

TALK: tuple[tuple[float, str, str | None, str], ...] = (
    (0.0, "said", "Rob", "Hi all, I am Rob, member of team plant"),
    (10.0, "heard", "Bot", "Hi team plant, I am Bot, I will complete task one"),
    (60.0, "garbled", None, ""),
    (300.0, "heard", "Bot", "Hi all, I am Bot, task one complete, I will complete task two"),
    (310.0, "heard", "Bot", "Hi all, I am Bot, task one complete"),
    (400.0, "heard", None, "Stop"),
    (500.0, "heard", "Bot", "Hi all, I am Bot, task two failed"),
    (600.0, "said", "Rob", "Hi all, I am Rob, task three complete"),
    (700.0, "heard", "Bot", "Hi Anna, I am Bot, member of team plant, report, I am free, battery twelve volts"),
    (800.0, "heard", "Zorg", "a sentence of another phrasebook"),
)


def rows(talk: tuple[tuple[float, str, str | None, str], ...] = TALK) -> list[TranscriptRow]:
    return [
        TranscriptRow(k + 1, BEGIN_S + at_s, TranscriptRecord(at_s, kind, who, text, 0.9 if kind == "heard" else None))  # type: ignore[arg-type]
        for k, (at_s, kind, who, text) in enumerate(talk)
    ]


def shift(**more: object) -> Shift:
    return read_shift(rows(**more), BOOK, plants(3), (BEGIN_S, BEGIN_S + 8 * HOUR_S))  # type: ignore[arg-type]


def test_who_did_what() -> None:
    found = shift()
    members = {member.name: member for member in found.members}
    assert (members["Rob"].done, members["Bot"].done, members["Bot"].failed) == ([3], [1], [2])
    assert members["Bot"].confidence == pytest.approx(0.9)
    assert members["Rob"].confidence is None, "it heard only others"
    assert (members["Rob"].team, members["Bot"].team) == ("plant", "plant")
    assert members["Bot"].report is not None
    assert members["Bot"].report.battery_v == 12.0
    assert (found.own, found.sentences, found.garbled, found.unknown) == ("Rob", 9, 1, 1)


def test_what_went_wrong() -> None:
    assert [trouble.text for trouble in shift().troubles] == ["“stop”, said by somebody", "Bot gave task 2 up"]


def test_a_note_of_the_robots_is_no_speech_that_it_did_not_understand() -> None:
    found = shift(talk=((0.0, "garbled", "Bot", "another voice than Bot's: oak, not elm"), (1.0, "garbled", None, "")))
    assert found.garbled == sum(part.garbled for part in found.bins) == 1
    assert [trouble.text for trouble in found.troubles] == ["another voice than Bot's: oak, not elm"]


def test_a_task_counts_once_however_often_it_is_reported_and_again_if_it_is_done_again() -> None:
    text = "Hi all, I am Bot, task one complete"
    talk = ((0.0, "heard", "Bot", text), (100.0, "heard", "Bot", text), (200.0 + SAME_REPORT_S, "heard", "Bot", text))
    assert shift(talk=talk).done == {1: 2}


def test_every_sentence_is_in_one_part_of_the_shift() -> None:
    found = shift()
    assert len(found.bins) == BINS
    assert sum(part.understood for part in found.bins) == 9
    assert (found.bins[0].understood, found.bins[0].garbled) == (9, 1)


def test_what_lies_outside_the_time_is_left_out() -> None:
    found = read_shift(rows(), BOOK, plants(3), (BEGIN_S + 350.0, BEGIN_S + 650.0))
    assert found.sentences == 3
    assert found.begin_s == BEGIN_S + 400.0


def test_the_page_is_well_formed_and_what_was_heard_is_never_markup() -> None:
    evil = "<script>x</script>"
    written = page(shift(talk=((0.0, "heard", evil, evil), (1.0, "garbled", None, evil))))
    assert "<script" not in written
    assert "&lt;script&gt;" in written
    counted: dict[str, int] = {}

    class Count(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            counted[tag] = counted.get(tag, 0) + 1

        def handle_endtag(self, tag: str) -> None:
            counted[tag] -= 1

    Count().feed(page(shift()))
    assert {tag for tag, n in counted.items() if n} <= {"meta"}


def test_an_empty_shift_can_be_told_too() -> None:
    found = shift(talk=())
    assert "Nobody said anything." in page(found)
    assert "tasks done              0" in as_text(found)


def remembered(folder: Path) -> Path:
    """A robot's memory with the talk in it."""
    store = Store(folder / "rob.sqlite3")
    for row in rows():
        store.append_transcript(row.record)
    store.close()
    return folder / "rob.sqlite3"


def test_the_command_prints_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "hvcpd.yaml").write_text("names: [Rob, Bot, Anna]\n")
    where = ["--memory", str(remembered(tmp_path)), "--config", str(tmp_path / "hvcpd.yaml")]
    arguments = ["report", *where, "--html", str(tmp_path / "shift.html")]
    assert report.run(make_parser().parse_args(arguments)) == 0
    text = capsys.readouterr().out
    assert "as Rob heard it" in text
    assert "free, battery 12 V" in text
    assert "Bot gave task 2 up" in text
    assert "The shift" in (tmp_path / "shift.html").read_text()
    assert report.run(make_parser().parse_args([*arguments, "--json"])) == 0
    assert json.loads(capsys.readouterr().out)["done"] == {"1": 1, "3": 1}
    arguments[-1] = str(tmp_path / "nowhere" / "shift.html")
    with pytest.raises(ConfigError, match="nowhere"):
        report.run(make_parser().parse_args(arguments))
