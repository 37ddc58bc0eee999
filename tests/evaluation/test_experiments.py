"""What the experiments make of their rows."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from hvcpd.evaluation import calls, confusions, coordinate, medium, missions, modes, robots, trails, volunteer, wake
from hvcpd.evaluation.listeners import OURS, PEER
from hvcpd.evaluation.trials import Scale
from hvcpd.reporting.events import Event, Performed, TaskChanged


def called(noise: float | None, distance_m: float, right: dict[str, int]) -> dict[str, Any]:
    counts = {**right, **{f"{name} wrong": [] for name in right}}
    return {"robot_noise_db_spl": noise, "distance_m": distance_m, "calls": 20, "listeners": list(right), **counts}


def test_the_call_tells_how_many_times_as_far_ours_reaches() -> None:
    rows = [
        called(50.0, d, {OURS: 20 if d < 9 else 0, PEER: 20 if d < 1.2 else 0}) for d in (0.5, 1.0, 1.44, 8.0, 10.125)
    ]
    found = wake.EXPERIMENT.summarise(rows)
    text = " ".join(found.paragraphs)
    assert "reaches 1.20 m, ours reaches 9.0 m: 7.5 times as far" in text
    cells = [dict(zip(found.table.columns, row, strict=True)) for row in found.table.rows]
    far = next(c for c in cells if (c["listener"], c["distance_m"]) == (PEER, 8.0))
    assert (far["right"], far["calls"], far["low"], far["high"]) == (0, 20, 0.0, pytest.approx(0.1611, abs=1e-3))


def test_where_ours_never_fails_only_a_bound_is_told() -> None:
    rows = [called(50.0, d, {OURS: 20, PEER: 20 if d < 1.2 else 0}) for d in (0.5, 1.0, 1.44, 20.0)]
    text = " ".join(wake.EXPERIMENT.summarise(rows).paragraphs)
    assert f"{OURS}, {wake.AS_FITTED}: > " in text
    assert "ours reaches more than" in text


def test_where_ours_never_succeeds_it_is_not_said_to_reach_so_far() -> None:
    rows = [called(50.0, d, {OURS: 0, PEER: 20 if d < 1.2 else 0}) for d in (0.5, 1.0, 1.44, 20.0)]
    assert "ours reaches less than" in " ".join(wake.EXPERIMENT.summarise(rows).paragraphs)


def test_a_missing_peer_is_no_fault() -> None:
    rows = [called(50.0, d, {OURS: 20 if d < 9 else 0}) for d in (0.5, 8.0, 10.0)]
    text = " ".join(wake.EXPERIMENT.summarise(rows).paragraphs)
    assert "times as far" not in text


def test_the_papers_steps_are_tried() -> None:
    near = [d for d in calls.distances(quick=False) if d <= 4.0]
    assert near == pytest.approx([k / 10 for k in range(1, 41)])
    assert set(calls.distances(quick=True)) <= set(calls.distances(quick=False))
    trials = wake.EXPERIMENT.trials(Scale(trials=20))
    here = [t for t in trials if t.settings["distance_m"] == 1.2 and t.settings["robot_noise_db_spl"] is None]
    assert sum(t.settings["calls"] for t in here) == 20


@pytest.mark.parametrize(("scale", "missions"), [(Scale(quick=True), 1), (Scale(quick=True, missions=3), 3)])
def test_missions_of_whole_robots_are_as_many_as_asked_for(scale: Scale, missions: int) -> None:
    of_robots = [t for t in coordinate.EXPERIMENT.trials(scale) if "mission" in t.settings]
    steps = {t.settings["distance_m"] for t in of_robots}
    assert len(of_robots) == missions * len(steps)
    assert Scale(trials=7).missions_each == 7


def test_missions_of_two_robots_are_the_same_again_and_are_counted() -> None:
    trials = [t for t in robots.EXPERIMENT.trials(Scale(seed=3, trials=2)) if t.settings["robots"] == 2]
    rows = [robots.EXPERIMENT.run(t) for t in trials]
    assert rows == [robots.EXPERIMENT.run(t) for t in trials]
    assert rows[0] != rows[1]
    found = robots.EXPERIMENT.summarise([*rows, {**rows[0], "complete": False, "ended_s": None}])
    line = dict(zip(found.table.columns, found.table.rows[0], strict=True))
    assert (line["missions"], line["complete"]) == (3, 2)
    assert line["airtime_s"] == pytest.approx((2 * rows[0]["airtime_s"] + rows[1]["airtime_s"]) / 3, abs=0.01)
    assert line["ended_s"] == pytest.approx((rows[0]["ended_s"] + rows[1]["ended_s"]) / 2, abs=0.1)


def test_confusions_are_counted_by_what_was_said() -> None:
    said = ["indigo", "yellow"]
    rows = [
        {"variant": "plain", "said": said, "taken": {OURS: said, PEER: ["orange", confusions.NOTHING]}},
        {"variant": "plain", "said": said[::-1], "taken": {OURS: said[::-1], PEER: [confusions.OTHER, "indigo"]}},
    ]
    found = confusions.EXPERIMENT.summarise(rows)
    cells = {row[1:3]: dict(zip(found.table.columns, row, strict=True)) for row in found.table.rows}
    assert (cells[PEER, "indigo"]["orange"], cells[PEER, "indigo"]["indigo"]) == (1, 1)
    assert (cells[PEER, "yellow"]["nothing"], cells[PEER, "yellow"]["another sentence"]) == (1, 1)
    assert (cells[OURS, "yellow"]["yellow"], cells[OURS, "indigo"]["indigo"]) == (2, 2)
    assert f"{PEER}, plain: of 4 orders 2 were taken for something else" in " ".join(found.paragraphs)
    (beside,) = found.beside
    assert f"plain {OURS}: 0 of 4, 0 not understood; plain {PEER}: 2 of 4, 1 not understood" in beside.here


def mode_rows(variant: str, listener: str, reach_m: float) -> list[dict[str, Any]]:
    return [
        {"variant": variant, "distance_m": d, "calls": 4, "listeners": [listener], listener: 4 * (d < reach_m)}
        | {f"{listener} wrong": []}
        for d in (0.5, 1.0, 1.44, 4.0, 9.0, 12.0)
    ]


def test_each_way_of_coordinating_has_its_own_pivotal_distance() -> None:
    rows = [*mode_rows(modes.SAID_ONCE, PEER, 1.2), *mode_rows(modes.WHOLE, OURS, 10.0)]
    found = coordinate.EXPERIMENT.summarise(rows[::-1])
    assert f"{PEER}, {modes.SAID_ONCE}: 1.2" in " ".join(found.paragraphs)
    assert f"{OURS}, {modes.WHOLE}: 10." in " ".join(found.paragraphs)
    cells = [dict(zip(found.table.columns, row, strict=True)) for row in found.table.rows]
    assert [c["right"] for c in cells if c["listener"] == OURS] == [4, 4, 4, 4, 4, 0]


def test_the_papers_distances_in_both_media_are_tried_alone_and_relayed() -> None:
    trials = medium.EXPERIMENT.trials(Scale(trials=1))
    tried = {(t.settings["medium"], t.settings["distance_m"], t.settings["relayed"]) for t in trials}
    assert {(name, m, r) for name, m in (("air", 180.0), ("water", 2030.0)) for r in (False, True)} <= tried
    rows = [{**t.settings, OURS: int(t.settings["distance_m"] < 300.0), f"{OURS} wrong": []} for t in trials]
    text = " ".join(medium.EXPERIMENT.summarise(rows).paragraphs)
    assert "1 of 1 at the paper's 180 m" in text
    assert "0 of 1 at the paper's 2,030 m" in text


def test_volunteers_are_tried_driving_off_and_standing_still_at_the_same_distances() -> None:
    trials = volunteer.EXPERIMENT.trials(Scale(trials=2))
    at = {how: [t.settings["distance_m"] for t in trials if t.settings["drives"] == how] for how in (True, False)}
    assert at[True] == at[False]
    assert len({t.key for t in trials}) == len(trials)
    assert 0.4 < volunteer.way_m() < 1.0, "what the paper's pivotal distance and its drop differ by is 0.5 m"
    rows = [*mode_rows("driving", PEER, 0.7), *mode_rows("standing", PEER, 1.2)]
    text = " ".join(volunteer.EXPERIMENT.summarise(rows).paragraphs)
    assert f"{PEER}, driving: 0.7" in text
    assert f"{PEER}, standing: 1.2" in text


def test_who_knows_of_a_task_is_who_noted_its_owner_last() -> None:
    def noted(robot: str, state: str, owner: str | None) -> TaskChanged:
        return TaskChanged(1.0, robot, 1, state, owner)

    events: list[Event] = [
        noted("Rob", "claimed", "Rob"),
        noted("Bot", "claimed", "Bot"),
        Performed(2.0, "Bot", 1, 0.0, 0.0),
    ]
    assert not missions.knows(events, "Rob", 1, "Bot")
    assert missions.knows([*events, noted("Rob", "done", "Bot")], "Rob", 1, "Bot")
    assert not missions.knows([*events, noted("Bot", "open", None)], "Bot", 1, "Bot")
    assert missions.doers([*events, Performed(3.0, "Rob", 1, 0.0, 0.0)]) == {1: ["Bot", "Rob"]}


@pytest.mark.slow
def test_robots_in_the_hall_order_and_obey() -> None:
    pytest.importorskip("pyroomacoustics", reason="needs pyroomacoustics, of the eval extra")
    trial = next(t for t in coordinate.EXPERIMENT.trials(Scale(quick=True, trials=1)) if "mission" in t.settings)
    assert coordinate.EXPERIMENT.run(trial)[OURS] == 1


@pytest.mark.slow
def test_objectives_are_understood_at_the_papers_distance() -> None:
    pytest.importorskip("pyroomacoustics", reason="needs pyroomacoustics, of the eval extra")
    trial = next(
        t for t in confusions.EXPERIMENT.trials(Scale(trials=1)) if t.settings["variant"] == "with alternatives"
    )
    row = confusions.EXPERIMENT.run(trial)
    assert sorted(row["said"]) == sorted(confusions.OBJECTIVES)
    assert row["taken"] == {OURS: row["said"]}


@pytest.mark.slow
def test_two_robots_water_a_plant_once_and_their_trails_lead_there() -> None:
    (whole,) = trails.EXPERIMENT.trials(Scale())
    row = trails.EXPERIMENT.run(replace(whole, settings={**whole.settings, "plants": 1}))
    assert (row["lost"], row["duplicates"]) == (0, 0)
    ((robot, number, _),) = row["watered"]
    ((_, _, x_m, y_m),) = row["plants"]
    nearest = {who: min(math.dist(p, (x_m, y_m)) for p in points) for who, points in row["trails"].items()}
    assert nearest[robot] < 0.3 < min(d for who, d in nearest.items() if who != robot)
    found = trails.EXPERIMENT.summarise([row])
    assert found.table.rows[0][:2] == (robot, number)


def test_a_missions_plants_are_counted_by_robot() -> None:
    row = {
        "plants": [[1, "water the green rose", 4.0, 1.0], [2, "water the violet rose", 4.0, -1.0]],
        "trails": {"Bot": [[1.0, 0.0]], "Rob": [[0.0, 0.0], [4.0, 1.0]]},  # sorted, as rows are kept
        "watered": [["Rob", 1, 30.0], ["Rob", 2, 60.0]],
        "lost": 0,
        "duplicates": 0,
        "virtual_s": 90.0,
    }
    found = trails.EXPERIMENT.summarise([row])
    assert "2 of 2 plants were watered, each exactly once, in 1.5 min: Rob 2 and Bot 0" in found.paragraphs[0]
    assert found.table.rows[1] == ("Rob", 2, "water the violet rose", 60.0)
    (beside,) = found.beside
    assert (beside.what, beside.here) == ("plants watered by Rob and Bot", "Rob 2 and Bot 0, each exactly once")
    worse = trails.EXPERIMENT.summarise([{**row, "lost": 1, "watered": []}])
    assert "0 of 2 plants were watered, 1 lost, 0 done more than once" in worse.paragraphs[0]
