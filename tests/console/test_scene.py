"""What the page shows of a running robot."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from hvcpd.console.alarms import alarms_of
from hvcpd.console.lines import MAX_LINES, Lines
from hvcpd.console.scene import Scene
from hvcpd.console.viewers import Viewers
from tests.console.asking import heard, status, task


def scene() -> Scene:
    made = Scene(Viewers())
    made.status(status())
    return made


def part(snapshot: dict[str, Any], kind: str) -> dict[str, Any]:
    return next(part for part in snapshot["parts"] if part["kind"] == kind)


def row(number: int, wall_s: float, at_s: float, kind: str, text: str) -> dict[str, Any]:
    """Of a transcript."""
    told = {"speaker": "Bot", "confidence": 0.9} if kind == "heard" else {"speaker": None, "confidence": None}
    return {"number": number, "wall_s": wall_s, "at_s": at_s, "kind": kind, "text": text, **told}


def test_a_heard_sentence_is_a_line_with_its_time_on_the_wall_and_how_sure_it_was() -> None:
    made = scene()
    made.event(heard())
    (line,) = made.lines.page()
    assert (line["who"], line["text"], line["at_s"], line["sort"]) == ("Bot", "Hi all, I am Bot", 1_000_001.0, "heard")
    assert line["marks"] == [{"kind": "good", "text": "heard, 97 % sure, 21 dB over the noise"}]
    made.event(heard(confidence=0.8))
    assert made.lines.page()[-1]["marks"][0]["kind"] == "unsure"


def test_a_seal_is_shown_and_a_wrong_one_as_wrong() -> None:
    made = scene()
    for seal in ("sealed", "not trusted", ""):
        made.event(heard(seal=seal))
    kinds = [[mark["kind"] for mark in line["marks"][1:]] for line in made.lines.page()]
    assert kinds == [["good"], ["bad"], []]


def test_each_speaker_keeps_a_colour() -> None:
    made = scene()
    for speaker in ("Bot", "Max", "Bot", "rob"):
        made.event(heard(speaker=speaker))
    assert [line["slot"] for line in made.lines.page()] == [1, 2, 1, 0]


def test_what_was_shown_as_it_happened_is_not_shown_again_from_the_transcript() -> None:
    made = scene()
    made.event(heard("one", at_s=101.0))
    made.event({"event": "garbled", "at_s": 103.0, "listener": "Rob"})
    made.rows(
        [
            row(1, 999_990.0, 90.0, "said", "before"),
            row(2, 1_000_001.2, 101.0, "heard", "one"),
            row(3, 1_000_003.2, 103.0, "garbled", ""),
            row(4, 900_000.0, 101.0, "heard", "one"),
        ]
    )
    assert [(line["text"], line["at_s"]) for line in made.lines.page()[2:]] == [
        ("before", 999_990.0),
        ("one", 900_000.0),
    ]


def test_what_a_robot_notes_of_a_speaker_is_shown_once() -> None:
    made = scene()
    made.event({"event": "noted", "at_s": 103.0, "robot": "Rob", "speaker": "Bot", "text": "another voice than Bot's"})
    made.rows([row(1, 1_000_003.1, 103.0, "garbled", "another voice than Bot's")])
    (line,) = made.lines.page()
    assert (line["sort"], line["text"]) == ("note", "another voice than Bot's")
    made.rows([row(2, 1_000_009.0, 109.0, "garbled", "not believed: no seal")])
    assert made.lines.page()[-1]["sort"] == "note"


def test_only_changes_are_told() -> None:
    made = scene()
    made.tasks([task()])
    viewer = made.viewers.join()
    made.tasks([task(lease_s=3.0)])
    made.status(status())
    told = asyncio.run(viewer.take(dict))
    assert {message["kind"] for message in told} == {"robots", "alarms"}
    made.tasks([task(state="claimed", owner="Bot")])
    told = asyncio.run(viewer.take(dict))
    assert next(m for m in told if m["kind"] == "board")["tasks"][0]["owner"] == "Bot"


def test_a_task_that_was_given_up_is_shown_as_failed_until_somebody_takes_it_over() -> None:
    made = scene()
    viewer = made.viewers.join()
    for state, shown in (("open", "failed"), ("claimed", "claimed"), ("done", "done")):
        made.tasks([task(state=state, failed_by=["Bot"])])
        told = asyncio.run(viewer.take(dict))
        assert next(m for m in told if m["kind"] == "board")["tasks"][0]["state"] == shown


def test_the_map_grows_with_the_robots_way() -> None:
    made = scene()
    made.tasks([task()])
    before = made.snapshot()["plan"]["svg"]
    for x in range(30):
        made.event({"event": "moved", "at_s": 101.0, "poses": [{"x_m": float(x), "y_m": 0.0, "heading_rad": 0.0}]})
    plan = made.snapshot()["plan"]
    assert plan["svg"] != before
    assert plan["trails"][0]["points"][-1] == (29.0, 0.0)
    assert (plan["trails"][0]["x_m"], plan["trails"][0]["heading_deg"]) == (29.0, 0.0)
    made.event({"event": "moved", "at_s": 101.0, "poses": [{"x_m": float("nan"), "y_m": 0.0, "heading_rad": 0.0}]})
    assert made.snapshot()["plan"] == plan


def test_a_place_that_only_one_robot_fits_in_is_on_the_map_as_soon_as_the_robot_tells_of_it() -> None:
    made, area = scene(), {"low_x_m": 4.0, "low_y_m": 0.0, "high_x_m": 5.0, "high_y_m": 2.0, "radius_m": 0.0}
    corridor = {"name": "corridor", "area": area, "keeper": None, "inside": False, "waiting": []}
    viewer = made.viewers.join()
    made.status(status(places=[corridor]))
    assert "The corridor: only one robot fits in" in made.snapshot()["plan"]["svg"]
    assert "plan" in {message["kind"] for message in asyncio.run(viewer.take(dict))}
    made.status(status(places=[{**corridor, "keeper": "Bot"}]))
    assert "plan" not in {message["kind"] for message in asyncio.run(viewer.take(dict))}, "it has not moved"
    made.status(status(places=[{"name": "corridor", "keeper": None}]))
    assert "corridor" not in made.snapshot()["plan"]["svg"], "an older daemon does not tell where it is"


def test_a_peer_is_shown_with_the_task_that_it_claimed() -> None:
    made = scene()
    made.tasks([task(3, state="claimed", owner="Bot")])
    peer = {"name": "Bot", "team": None, "present": False, "heard_ago_s": 200.0, "confidence": 0.9, "snr_db": None}
    made.status(status(peers=[peer]))
    shown = part(made.snapshot(), "robots")["robots"][1]
    assert shown["doing"] == "has task 3, water the red rose"
    assert shown["note"] == "heard 3 min ago, 90 % sure"
    assert shown["present"] is False


def test_a_daemon_that_is_back_is_shown_whole() -> None:
    made = scene()
    viewer = made.viewers.join()
    made.link(False, "gone")
    made.event(heard("while nobody looked"))
    made.link(True, "Connected to Rob")
    (snapshot,) = asyncio.run(viewer.take(made.snapshot))
    assert part(snapshot, "link") == {"kind": "link", "up": True, "text": "Connected to Rob"}
    assert snapshot["lines"][-1]["text"] == "while nobody looked"


def test_what_would_steer_a_page_or_a_terminal_is_replaced() -> None:
    made = scene()
    made.event(heard("a\x1b[2J\u202eb", speaker="B\x07ot"))
    (line,) = made.lines.page()
    assert (line["who"], line["text"]) == ("B\ufffdot", "a\ufffd[2J\ufffdb")


@pytest.mark.parametrize(
    ("more", "tasks", "words"),
    [
        ({"stopped": True}, [], "stopped"),
        ({"button_pressed": True}, [], "wire is broken"),
        ({"wheels": {"fault": "no answer"}}, [], "no answer"),
        ({"battery_v": 11.0}, [], "11.0 V"),
        ({"sound": {"listening": False, "mute": False}}, [], "hears nothing"),
        ({"sound": {"listening": True, "mute": True}}, [], "mute"),
        ({"sound": {"listening": True, "mute": False, "too_busy": True}}, [], "computer is too busy"),
        ({"memory": {"lost": 3}}, [], "3 records"),
        ({"memory": {"lost": 3, "fault": "the disk is full"}}, [], "the disk is full"),
        ({"memory": {"lost": 0, "unkept": "read-only"}}, [], "“resume” is not kept: read-only"),
        ({}, [task(2, failed_by=["Bot"]), task(3, state="claimed", failed_by=["Bot"])], "given up by Bot"),
    ],
)
def test_alarms(more: dict[str, Any], tasks: list[dict[str, Any]], words: str) -> None:
    (alarm,) = alarms_of(status(**more), tasks)
    assert words in alarm["text"]


def test_a_lost_memory_is_an_alarm_until_somebody_says_resume() -> None:
    lost = {"lost": 0, "loss": "rob.latch is missing"}
    assert [alarm["id"] for alarm in alarms_of(status(stopped=True, memory=lost), [])] == ["stopped", "loss"]
    assert alarms_of(status(stopped=False, memory=lost), []) == []


def test_where_all_is_well_there_is_no_alarm() -> None:
    assert alarms_of(status(wheels=None, battery_v=None), [task(state="done")]) == []
    assert alarms_of(status(state="starting", sound={"listening": False}), []) == [], "it is only starting"


def test_so_many_lines_are_kept_and_their_numbers_stay() -> None:
    lines = Lines()
    for _ in range(MAX_LINES + 10):
        lines.add({})
    assert lines.first == 10
    assert lines.page(before=11)[0]["n"] == 10
    assert lines.page(after=3)[0]["n"] == 10
