"""The report of a shift, from a transcript."""

from __future__ import annotations

import itertools
import json
import re
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest

from hvcpd.control.cli import make_parser
from hvcpd.control.live import report
from hvcpd.errors import ConfigError
from hvcpd.memory.store import Store, TranscriptReader, TranscriptRecord, TranscriptRow
from hvcpd.reporting.ends import SAME_REPORT_S
from hvcpd.reporting.occurrences import occurrences
from hvcpd.reporting.shift import BINS, Shift, read_shift
from hvcpd.reporting.shift_page import as_json, as_text, page, wall_clock
from tests.coordination.mission import Mission, plants
from tests.reporting.shift_example import flower_tasks, made_up
from tests.reporting.shown import Page

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
    assert (found.own, found.said, found.heard, found.garbled, found.unknown) == ("Rob", 2, 7, 1, 1)


def test_a_confirmation_of_a_report_that_was_heard_is_no_other_robots_report() -> None:
    """Bot may have told whose report it was; it counted as a deed of its own, three of eleven in a day of four."""
    talk = (
        (0.0, "said", "Rob", "Hi all, I am Rob, task one complete"),
        (10.0, "heard", "Anna", "Hi Bot, I am Anna, confirmed one complete"),
        (700.0, "heard", "Anna", "Hi Bot, I am Anna, confirmed one complete"),
    )
    done = {member.name: member.done for member in shift(talk=talk).members}
    assert (done["Rob"], done["Bot"]) == ([1], [1]), "ten minutes later it is another time"


def test_what_went_wrong() -> None:
    assert [trouble.text for trouble in shift().troubles] == [
        "“stop”, said by somebody",
        f"Bot gave up task 2, {plants(3)[1].name}",
    ]


def test_a_note_of_the_robots_is_no_speech_that_it_did_not_understand() -> None:
    found = shift(talk=((0.0, "garbled", "Bot", "another voice than Bot's: oak, not elm"), (1.0, "garbled", None, "")))
    assert found.garbled == sum(part.garbled for part in found.bins) == 1
    assert [trouble.text for trouble in found.troubles] == ["another voice than Bot's: oak, not elm"]


def test_a_task_counts_once_however_often_it_is_reported_and_again_if_it_is_done_again() -> None:
    text = "Hi all, I am Bot, task one complete"
    talk = ((0.0, "heard", "Bot", text), (100.0, "heard", "Bot", text), (200.0 + SAME_REPORT_S, "heard", "Bot", text))
    assert shift(talk=talk).done == {1: 2}


def test_a_task_that_is_claimed_once_more_is_done_once_more_however_soon() -> None:
    """Of a task that is due every ten minutes, and of one that somebody wants again at once, reports are close."""
    talk = (
        (0.0, "heard", "Bot", "Hi all, I am Bot, task one complete, I will complete task two and three"),
        (100.0, "heard", "Bot", "Hi all, I am Bot, task two and three complete"),
        (110.0, "heard", "Anna", "Hi Bot, I am Anna, task three again"),
        (120.0, "heard", "Bot", "Hi all, I am Bot, task two and three complete"),
        (130.0, "heard", "Bot", f"Hi all, I am Bot, I will {plants(3)[0].name}"),
        (150.0, "heard", "Bot", "Hi all, I am Bot, task one complete, I will complete task two and three"),
        (200.0, "heard", "Bot", "Hi all, I am Bot, task two and three complete"),
    )
    assert shift(talk=talk).done == {1: 2, 2: 2, 3: 2}


def test_a_task_is_given_up_once_however_often_that_is_said() -> None:
    """Nobody confirmed it, so that it was three troubles; and the one who does it now lost it again."""
    text = "Hi all, I am Rob, task one failed"
    claims = "Hi team plant, I am Rob, I will complete task one"
    talk = (
        (0.0, "said", "Rob", claims),
        (100.0, "said", "Rob", text),
        (105.0, "heard", "Bot", "Hi Rob, I am Bot, confirmed one, I will complete task two"),
        (120.0, "said", "Rob", text),
        (130.0, "heard", "Bot", "Hi all, I am Bot, task two complete, I will complete task one"),
        (140.0, "said", "Rob", text),
        (200.0, "heard", "Bot", "Hi all, I am Bot, task one complete"),
        (300.0, "said", "Rob", claims),
        (310.0, "said", "Rob", text),
    )
    found = shift(talk=talk)
    assert [len(found.troubles), *(member.failed for member in found.members)] == [2, [1, 1], []]
    ends = [(s.robot, s.from_s, s.to_s, s.ended) for s in found.story.spans if s.task == 1]
    assert ends[:2] == [("Rob", 0.0, 100.0, "given up"), ("Bot", 130.0, 200.0, "done")]


def test_of_two_robots_that_share_a_task_neither_has_given_it_up() -> None:
    """Each claim of one, and its report, ended the other's bar: "given up", five times of a task that both did."""
    both, third = "Hi all, I am {0}, I will complete task one", "Hi team plant, I am Anna, I will complete task one"
    talk = (
        (0.0, "said", "Rob", both.format("Rob")),
        (10.0, "heard", "Bot", both.format("Bot")),
        (20.0, "said", "Rob", f"Hi all, I am Rob, completing task, {plants(3)[0].name}"),
        (30.0, "heard", "Bot", "Hi all, I am Bot, task one complete"),
        (40.0, "said", "Rob", "Hi all, I am Rob, task one complete"),
        (100.0, "said", "Rob", both.format("Rob")),
        (110.0, "heard", "Bot", both.format("Bot")),
        (120.0, "heard", "Anna", third),
        (130.0, "heard", "Bot", "Hi all, I am Bot, task one failed"),
        (140.0, "heard", "Anna", "Hi all, I am Anna, task one complete"),
    )
    tasks = tuple(replace(task, robots=2) for task in plants(3))
    found = read_shift(rows(talk), BOOK, tasks, (BEGIN_S, BEGIN_S + HOUR_S))
    assert [(s.robot, s.from_s, s.to_s, s.ended) for s in found.story.spans] == [
        ("Rob", 0.0, 40.0, "done"),
        ("Bot", 10.0, 30.0, "done"),
        ("Rob", 100.0, 120.0, "given up"),
        ("Bot", 110.0, 130.0, "given up"),
        ("Anna", 120.0, 140.0, "done"),
    ], "there is no place for a third"


def test_what_two_robots_do_together_counts_once() -> None:
    """The figures said "11 tasks done", and the list of what was due "10 done"."""
    deeds = [(BEGIN_S, 1, "Rob"), (BEGIN_S + 5.0, 1, "Bot"), (BEGIN_S + 10.0, 2, "Bot"), (BEGIN_S + 20.0, 3, "Bot")]
    tasks = tuple(replace(task, robots=2 if task.number < 3 else 1) for task in plants(3))
    talk = (
        (0.0, "said", "Rob", "Hi all, I am Rob, task one complete"),
        (5.0, "heard", "Bot", "Hi all, I am Bot, task one complete"),
        (10.0, "heard", "Bot", "Hi all, I am Bot, task two complete"),
        (20.0, "heard", "Bot", "Hi all, I am Bot, task three complete"),
    )
    span_s = BEGIN_S, BEGIN_S + HOUR_S
    found = read_shift(rows(talk), BOOK, tasks, span_s, occurrences(tasks, deeds, *span_s))
    text = as_text(found)
    assert "  2  tasks done" in text
    assert "What was due: 2 done, 1 not done" in text
    assert ">2</dd>" in page(found)
    assert page(found).count("half done: ") == 1
    assert as_json(found)["done"] == {1: 1, 3: 1}


def test_a_robot_that_was_renamed_and_has_a_namesake_said_only_what_it_said_itself() -> None:
    talk = (
        (0.0, "said", "Rob", "Hi all, I am Rob"),
        (10.0, "heard", "Rob", "Hi all, I am Rob"),
        (20.0, "heard", "Bot", "Hi all, I am Bot"),
        (30.0, "said", "Anna", "Hi all, I am Anna"),
    )
    found = shift(talk=talk)
    assert (found.own, found.said, found.heard) == ("Anna", 2, 2)
    assert "as Anna heard it" in as_text(found)
    assert {member.name: member.sentences for member in found.members} == {"Anna": 1, "Rob": 2, "Bot": 1}


def test_a_clock_that_was_set_back_hides_nothing() -> None:
    talk = tuple((at_s, "heard", "Bot", "Hi all, I am Bot") for at_s in (3000.0, 3010.0, 0.0, 10.0, 1500.0))
    found = shift(talk=talk)
    assert found.begin_s == BEGIN_S
    assert sum(part.heard for part in found.bins) == found.heard == 5
    assert all(line.said.at_s >= 0.0 for line in found.story.lines)


def test_a_shift_over_new_year_names_both_years() -> None:
    found = read_shift(rows(), BOOK, plants(3), (BEGIN_S, BEGIN_S + 150 * 24 * HOUR_S))
    assert re.search(r"September 2026, [\d:]+ to \w+ \d+ February 2027, [\d:]+, as Rob", as_text(found))


def test_every_sentence_is_in_one_part_of_the_shift() -> None:
    found = shift()
    assert len(found.bins) == BINS
    assert sum(part.heard for part in found.bins) == found.heard == 7
    assert (found.bins[0].heard, found.bins[0].garbled) == (7, 1)


def test_what_lies_outside_the_time_is_left_out() -> None:
    found = read_shift(rows(), BOOK, plants(3), (BEGIN_S + 350.0, BEGIN_S + 650.0))
    assert found.said + found.heard == 3
    assert found.begin_s == BEGIN_S + 400.0


def test_the_page_is_well_formed_and_what_was_heard_is_never_markup() -> None:
    evil = "<script>x</script>"
    written = page(shift(talk=((0.0, "heard", evil, evil), (1.0, "garbled", None, evil))))
    assert "<script" not in written
    assert "&lt;script&gt;" in written
    Page(page(shift()))


def test_an_empty_shift_can_be_told_too() -> None:
    found = shift(talk=())
    assert "Nobody said anything." in page(found)
    assert "Nobody was heard." in page(found), "a chart without a bar, whose highest bar was 1"
    assert "0  tasks done" in as_text(found)


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
    report.run(make_parser().parse_args(arguments))
    text = capsys.readouterr().out
    assert "as Rob heard it" in text
    assert "free, battery 12 V" in text
    assert "Bot gave up task 2, water" in text
    assert "The shift" in (tmp_path / "shift.html").read_text()
    report.run(make_parser().parse_args([*arguments, "--json"]))
    assert json.loads(capsys.readouterr().out)["done"] == {"1": 1, "3": 1}
    arguments[-1] = str(tmp_path / "nowhere" / "shift.html")
    with pytest.raises(ConfigError, match="nowhere"):
        report.run(make_parser().parse_args(arguments))


def test_since_may_reach_as_far_back_as_one_likes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Store(tmp_path / "rob.sqlite3").close()
    arguments = ["report", "--memory", str(tmp_path / "rob.sqlite3"), "--since", "999999999d"]
    report.run(make_parser().parse_args(arguments))
    assert "as the robot heard it" in capsys.readouterr().out


def test_what_is_passed_on_or_only_confirmed_counts_for_who_did_it_and_once() -> None:
    talk = (
        (0.0, "heard", "Bot", "Hi Anna, I am Bot, Rob says task one complete"),
        (20.0, "said", "Rob", "Hi all, I am Rob, task one complete"),
        (40.0, "heard", "Bot", "Hi Rob, I am Bot, confirmed one complete"),
        (60.0, "said", "Rob", "Hi Bot, I am Rob, confirmed two complete"),
    )
    members = {member.name: member for member in shift(talk=talk).members}
    assert (members["Rob"].done, members["Bot"].done) == ([1], [2])


def test_a_confirmation_tells_whose_task_is_done_also_where_the_sentence_goes_on() -> None:
    """Of "confirmed one complete, I will complete task two" only the end counted."""
    talk = (
        (0.0, "heard", "Bot", "Hi Rob, I am Bot, confirmed one complete, I will complete task two"),
        (90.0, "said", "Rob", "Hi Bot, I am Rob, confirmed two complete, task three complete"),
    )
    members = {member.name: member for member in shift(talk=talk).members}
    assert (members["Rob"].done, members["Bot"].done) == ([1, 3], [2])


def test_nobody_is_drawn_at_two_tasks_at_once() -> None:
    talk = (
        (0.0, "heard", "Bot", "Hi all, I am Bot, I will complete task one"),
        (100.0, "heard", "Bot", "Hi all, I am Bot, I will complete task two"),  # how task one ended was not heard
        (200.0, "said", "Rob", "Hi all, I am Rob, I will complete task two"),
        (300.0, "said", "Rob", "Hi all, I am Rob, task two complete, I will complete task three"),
    )
    spans = [(s.robot, s.task, s.from_s, s.to_s, s.ended) for s in shift(talk=talk).story.spans]
    assert spans[:3] == [
        ("Bot", 1, 0.0, 100.0, "unfinished"),
        ("Bot", 2, 100.0, 200.0, "given up"),
        ("Rob", 2, 200.0, 300.0, "done"),
    ]
    assert [span[:4] for span in spans[3:]] == [("Rob", 3, 300.0, pytest.approx(305.2))]


def test_of_two_tasks_at_once_both_count_and_the_first_is_drawn() -> None:
    talk = (
        (0.0, "heard", "Bot", "Hi all, I am Bot, I will complete task two and one"),
        (90.0, "heard", "Bot", "Hi all, I am Bot, task two and one complete"),
        (95.0, "said", "Rob", "Hi Bot, I am Rob, confirmed two and one complete"),
    )
    found = shift(talk=talk)
    assert [member.done for member in found.members if member.name == "Bot"] == [[2, 1]]
    spans = [(s.robot, s.task, s.from_s, s.to_s, s.ended) for s in found.story.spans]
    assert spans == [("Bot", 2, 0.0, 90.0, "done")]


@pytest.mark.parametrize(
    ("names", "count"),
    [(("Rob",), 3), (("Rob", "Bot"), 12), (("Rob", "Bot", "Zoe", "Kira", "Omar", "Ada"), 30)],
    ids=["alone", "two", "six"],
)
def test_every_number_on_the_page_and_in_the_text_is_the_memorys(
    names: tuple[str, ...], count: int, tmp_path: Path
) -> None:
    made = made_up(names, flower_tasks(count))
    account, named = made.account, {task.number: task.name for task in made.tasks}
    made.write(tmp_path / "rob.sqlite3")
    kept = TranscriptReader(tmp_path / "rob.sqlite3").rows()
    rows = [replace(row, wall_s=each.wall_s) for row, each in zip(kept, made.rows, strict=True)]
    found = read_shift(rows, made.book, made.tasks, (made.rows[0].wall_s or 0.0, made.end_s))
    seen = Page(page(found))
    rows_seen = list(seen.rows())
    terms, values = ([each.parts[0] for each in seen.elements if each.tag == tag] for tag in ("dt", "dd"))
    figures = dict(zip(terms, values, strict=True))

    heard = sum(account.heard.values())
    troubles = account.stops + len(account.failed)
    share = f"{100 * heard / (heard + account.garbled):.0f} %" if heard + account.garbled else "–"
    assert list(figures.values()) == [
        *map(str, (len(account.done), account.said, heard, account.garbled)),
        share,
        str(troubles),
    ]
    text = as_text(found)
    for what, value in figures.items():
        assert re.search(rf"^ *{re.escape(value)}  {re.escape(what)}$", text, re.M), (what, value)

    members = {row[0]: row for row in rows_seen if row[0] in names}
    assert list(members) == list(names)
    for name in names:
        sentences = account.said if name == "Rob" else account.heard[name]
        done = [number for who, number in account.done if who == name]
        assert members[name][2] == str(sentences)
        listed = re.findall(r"task (\d+), ([a-z ]+?); ", members[name][-1])
        assert listed == [(str(number), named[number]) for number in done]
        assert re.search(rf"^{name} +plant +{sentences} ", text, re.M)
        sure = [row.record.confidence for row in rows if row.record.speaker == name and row.record.confidence]
        assert members[name][3] == (f"{100 * sum(sure) / len(sure):.0f} %" if sure else "–")

    tasks = {int(row[0]): row for row in rows_seen if row[0].isdigit()}
    assert {number: row[1] for number, row in tasks.items()} == named
    doers = {number: name for name, number in account.done}
    for number, row in tasks.items():
        assert row[2].partition(" by ")[2] == doers.get(number, ""), row
        assert (row[2] == "no report heard") == (number not in doers)
    assert text.count(", water the") == len(account.done) + len(account.failed)

    assert (
        len([each for each in seen.elements if each.tag == "li" and any(up.is_of("troubles") for up in each.path)])
        == troubles
    )
    bars = re.findall(r': (\d+) understood, (\d+) not"', page(found))
    assert [sum(map(int, column)) for column in zip(*bars, strict=True)] == [heard, account.garbled]
    assert page(found).count('class="carried-out"') == len(account.done)


def test_columns_stay_apart_however_long_names_and_numbers_are() -> None:
    long = "Wilhelminachristiane"
    talk = tuple((float(k), "heard", long, f"Hi all, I am {long}, task {k}") for k in range(120))
    lines = as_text(shift(talk=talk)).splitlines()
    assert any(re.fullmatch(r" *100 %  understood of the speech heard", line) for line in lines)
    assert any(line.startswith(f"{long}  –") for line in lines)


@pytest.mark.parametrize(
    ("hours", "expected"),
    [
        (0.2, r"\d\d:\d\d:\d\d"),
        (2, r"\d\d:\d\d"),
        (30, r"\w\w\w \d\d:\d\d"),
        (300, r"\d\d \w\w\w \d\d:\d\d"),
        (3000, r"\d\d \w\w\w 2026 \d\d:\d\d"),
    ],
)
def test_times_tell_as_much_as_the_shifts_length_asks_for(hours: float, expected: str) -> None:
    began = datetime(2026, 9, 21, 8, 0).timestamp()
    found = read_shift(rows(), BOOK, plants(3), (began, began + hours * HOUR_S))
    assert re.fullmatch(expected, wall_clock(began + 60.0, found))


def test_times_on_the_timeline_of_a_few_minutes_in_a_long_shift_differ() -> None:
    talk = ((0.0, "said", "Rob", "Hi all, I am Rob"), (330.0, "said", "Rob", "Hi all, I am Rob"))
    found = read_shift(rows(talk), BOOK, plants(3), (BEGIN_S, BEGIN_S + 8 * HOUR_S))
    told = re.findall(r'<text class="scale"[^>]*>([^<]+)</text>', page(found))
    assert len(told) == len(set(told)) > 1


@pytest.mark.parametrize(
    "end_s", [60.0, 900.0, 3600.0, 8 * HOUR_S, 3 * 24 * HOUR_S, 40 * 24 * HOUR_S, 50 * 365 * 24 * HOUR_S]
)
def test_times_on_the_timeline_do_not_overlap(end_s: float) -> None:
    talk = ((0.0, "said", "Rob", "Hi all, I am Rob"), (end_s, "said", "Rob", "Hi all, I am Rob"))
    found = read_shift(rows(talk), BOOK, plants(3), (BEGIN_S, BEGIN_S + end_s))
    marks = re.findall(r'<text class="scale" x="([-\d.]+)" [^>]*>([^<]+)</text>', page(found))
    assert len(marks) > 1
    for (x, told), (next_x, _) in itertools.pairwise(marks):
        assert float(next_x) - float(x) > 7.4 * len(told)
