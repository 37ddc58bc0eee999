"""What the page's addresses give."""

from __future__ import annotations

import pytest

from hvcpd.console.lines import PAGE_LINES
from hvcpd.console.viewers import MAX_VIEWERS
from hvcpd.errors import NotDoneError, NotRunningError
from tests.console.asking import Page, heard, request, status


def test_stopping_halts_this_robot_first_and_then_tells_the_others() -> None:
    page = Page()
    answer = page.act({"do": "stop", "all": True})
    assert page.robot.asked == [("stop", {}), ("say", {"text": "stop"})]
    assert "Rob is stopped" in answer.json()["told"]


def test_the_others_are_told_before_the_stop_is_on_the_disk() -> None:
    """A slow disk kept them going for up to 5 s."""
    page = Page()
    page.robot.turns["stop"] = 10
    page.act({"do": "stop", "all": True})
    assert page.robot.answered == ["say", "stop"]


def test_a_stop_that_somebody_has_undone_meanwhile_says_so() -> None:
    page = Page()
    page.robot.replies["stop"] = {"stopped": False}
    assert page.act({"do": "stop"}).json()["told"] == "Rob was released meanwhile"


def test_a_stop_counts_even_if_the_others_cannot_be_told() -> None:
    page = Page()
    page.robot.refusals["say"] = NotDoneError("8 sentences wait")
    answer = page.act({"do": "stop", "all": True})
    assert answer.status == 200
    assert answer.json()["told"] == "Rob is stopped; but the others could not be told: 8 sentences wait"


def test_a_task_is_wanted_again() -> None:
    page = Page()
    page.robot.refusals["task"] = NotDoneError("there is no task 9")
    assert page.act({"do": "skip", "number": 9}).status == 409
    page.robot.refusals.clear()
    page.robot.asked.clear()
    assert "task 3 is done again" in page.act({"do": "again", "number": 3}).json()["told"]
    assert page.robot.asked == [("task", {"do": "again", "number": 3})]


def test_a_task_is_added_to_this_robot_and_removed() -> None:
    page, task = Page(), {"number": 6, "name": "water the red tulip", "actions": [{"water": 5}]}
    told = page.act({"do": "add", "task": task}).json()["told"]
    assert told == "task 6 is taken up as soon as its words are known; the others are not told: do the same for each"
    assert "task 6 is gone" in page.act({"do": "remove", "number": 6}).json()["told"]
    assert page.robot.asked == [("task", {"do": "add", "task": task}), ("task", {"do": "remove", "number": 6})]
    page.robot.refusals["task"] = NotDoneError("task 6: name: 'water' is one word; use two to eight")
    assert page.act({"do": "add", "task": "water"}).json() == {
        "error": "task 6: name: 'water' is one word; use two to eight"
    }


def test_who_asks_only_whether_there_are_events_takes_no_place() -> None:
    """Each such request took a place for good, and the 25th page got none."""
    page = Page()
    answer = request(page.app, "/events", "HEAD", b"")
    assert (answer.status, answer.body) == (200, b"")


def test_without_a_daemon_a_stop_says_what_to_do() -> None:
    page = Page()
    page.robot.refusals["stop"] = NotRunningError("The robot's daemon does not answer")
    answer = page.act({"do": "stop"})
    assert answer.status == 503
    assert "by voice" in answer.json()["error"]


def test_resuming_must_be_confirmed() -> None:
    page = Page()
    for wanted in ({"do": "resume"}, {"do": "resume", "confirmed": "true"}):
        assert page.act(wanted).status == 400
    assert page.robot.asked == []
    assert page.act({"do": "resume", "confirmed": True}).status == 200
    assert page.robot.asked == [("resume", {})]


@pytest.mark.parametrize(
    ("reply", "told"),
    [
        ({}, "Rob may take on tasks again, and says “resume” to all others as soon as nobody else speaks"),
        ({"untold": "Rob is leaving"}, "Rob may take on tasks again; but the others could not be told: Rob is leaving"),
        ({"stopped": True}, "Rob was stopped again meanwhile"),
    ],
)
def test_all_are_resumed_by_one_request_so_that_a_stop_cannot_come_in_between(
    reply: dict[str, object], told: str
) -> None:
    """A stop between two requests left some robots resumed and others stopped, without a word of it."""
    page = Page()
    page.robot.replies["resume"] = reply
    assert page.act({"do": "resume", "all": True, "confirmed": True}).json()["told"] == told
    assert page.robot.asked == [("resume", {"all": True})]


@pytest.mark.parametrize("wanted", [{}, {"do": "say"}, [], "stop", {"do": ["stop"]}, {"do": "stop", "x": "y" * 5000}])
def test_anything_else_is_refused(wanted: object) -> None:
    page = Page()
    assert page.act(wanted).status == 400
    assert page.robot.asked == []


def test_the_conversation_is_had_in_pages() -> None:
    page = Page()
    for number in range(1000):
        page.scene.event(heard(f"task {number}", at_s=float(number)))
    newest = page.get("/lines").json()
    assert [line["n"] for line in newest["lines"]] == list(range(1000 - PAGE_LINES, 1000))
    before = page.get(f"/lines?before={newest['lines'][0]['n']}").json()["lines"]
    assert before[-1]["n"] == newest["lines"][0]["n"] - 1
    after = page.get("/lines?after=10").json()["lines"]
    assert (after[0]["n"], len(after)) == (11, PAGE_LINES)
    assert page.get("/lines?before=0").json()["lines"] == []
    assert page.get("/lines?after=999").json()["lines"] == []
    assert page.get("/lines?before=-1&after=x").json() == newest, "what is no number is not heeded"


def test_names_are_never_markup() -> None:
    page = Page()
    page.scene.status(status(name="<img src=x>"))
    assert "<img" not in page.get("/").text


def test_more_pages_than_there_is_room_for_are_refused() -> None:
    page = Page()
    for _ in range(MAX_VIEWERS):
        page.scene.viewers.join()
    assert page.get("/events").status == 503


@pytest.mark.parametrize(
    "name", ["main.js", "talk.js", "board.js", "map.js", "controls.js", "replay.js", "tour.js", "dom.js", "icon.svg"]
)
def test_the_pages_parts_can_be_had(name: str) -> None:
    answer = Page().get(f"/part/{name}")
    assert answer.status == 200
    assert answer.headers["content-type"].startswith(("text/javascript", "image/svg+xml"))


def test_the_style_sheet_is_no_markup() -> None:
    style = Page().get("/style.css").text
    assert "main > .alarms" in style
    assert "&gt;" not in style
    assert "&#34;" not in style


@pytest.mark.parametrize("name", ["index.html", "../app.py", "..%2fapp.py", "app.py", ""])
def test_nothing_else_can(name: str) -> None:
    assert Page().get(f"/part/{name}").status == 404
