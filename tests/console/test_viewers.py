"""Several pages at once: each gets everything, and none waits for another."""

from __future__ import annotations

import asyncio
from typing import Any

from hvcpd.console.viewers import MAX_VIEWERS, MAX_WAITING, Viewer, Viewers


def line(number: int) -> dict[str, Any]:
    return {"kind": "line", "line": {"n": number}}


def taken(viewer: Viewer) -> list[dict[str, Any]]:
    return asyncio.run(asyncio.wait_for(viewer.take(lambda: {"kind": "snapshot"}), 1.0))


def test_each_viewer_is_told_each_line_in_order() -> None:
    viewers = Viewers()
    first, second = viewers.join(), viewers.join()
    for number in range(3):
        viewers.tell(line(number))
    assert taken(first) == taken(second) == [line(number) for number in range(3)]


def test_of_levels_and_places_only_the_newest_is_told() -> None:
    viewers = Viewers()
    viewer = viewers.join()
    for level in range(100):
        viewers.tell({"kind": "level", "level_dbfs": -level})
        viewers.tell({"kind": "moved", "name": "Rob", "x_m": level})
        viewers.tell({"kind": "moved", "name": "Bot", "x_m": -level})
    assert taken(viewer) == [
        {"kind": "level", "level_dbfs": -99},
        {"kind": "moved", "name": "Rob", "x_m": 99},
        {"kind": "moved", "name": "Bot", "x_m": -99},
    ]


def test_a_viewer_that_does_not_read_is_shown_everything_anew_and_costs_the_others_nothing() -> None:
    viewers = Viewers()
    slow, quick = viewers.join(), viewers.join()
    told: list[dict[str, Any]] = []
    for number in range(10 * MAX_WAITING):
        viewers.tell(line(number))
        if number % 100 == 99 or number == 10 * MAX_WAITING - 1:
            told += taken(quick)
    assert [message["line"]["n"] for message in told] == list(range(10 * MAX_WAITING))
    assert len(slow._waiting) == MAX_WAITING, "what waits is bounded"
    assert taken(slow) == [{"kind": "snapshot"}]
    viewers.tell(line(7))
    assert taken(slow) == [line(7)]


def test_who_has_left_is_told_no_more_and_makes_room() -> None:
    viewers = Viewers()
    all_ = [viewers.join() for _ in range(MAX_VIEWERS)]
    assert viewers.full
    viewers.leave(all_[0])
    assert not viewers.full
    viewers.tell(line(1))
    assert not all_[0]._waiting


def test_who_is_let_go_is_told_what_waited_and_then_no_more() -> None:
    viewers = Viewers()
    viewer = viewers.join()
    viewers.tell(line(1))
    viewers.end()
    assert taken(viewer) == [line(1)]
    assert viewer.ended
