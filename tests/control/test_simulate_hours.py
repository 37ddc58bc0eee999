"""Hours of a team by words, and what became of all that was due."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from hvcpd.config.recurrence import Recurrence
from hvcpd.config.tasks import TaskDefinition, Wait
from hvcpd.control.cli import main, make_parser
from hvcpd.control.keys.key import today
from hvcpd.control.simulate.day import day_plan
from hvcpd.control.simulate.team import load_team
from hvcpd.coordination.actions import Speech
from hvcpd.reporting.occurrences import JUST_DUE_S, Occurrence, occurrences
from hvcpd.security.keyring import KeyFile, fresh_entry, write_key_file

TASKS = """tasks:
  - {number: 1, name: water the green rose, every: "FREQ=DAILY;BYHOUR=8,18", deadline: 30 min, actions: [{wait: 5}]}
  - {number: 2, name: water the violet rose, every: 6 h, priority: 2, after: [1], actions: [{wait: 5}]}
  - {number: 3, name: sweep the long floor, actions: [{wait: 20}]}
"""
HOURLY = TaskDefinition(1, "look", None, (Wait(1.0),), every=Recurrence("1 h"), deadline_s=600.0)


def hours(tmp_path: Path, *options: str) -> int:
    (tmp_path / "tasks.yaml").write_text(TASKS)
    return main(["simulate", "--tasks", str(tmp_path / "tasks.yaml"), "--robots", "Rob,Bot", *options])


def test_a_day_is_told_with_what_was_due_and_by_whom_it_was_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = []
    for _ in range(2):
        assert hours(tmp_path, "--hours", "24", "--loss", "0.1", "--report", str(tmp_path), "--json") == 0
        out, err = capsys.readouterr()
        assert "task 3: done only once" in err
        told.append(out)
    assert told[0] == told[1], "the same seed, the same shift"
    due = json.loads(told[0])["due"]
    assert [each["task"] for each in due] == [2, 3, 2, 1, 2, 1, 2]
    assert {each["became"] for each in due} == {"done"}
    assert all(each["deeds"][0][1] in ("Rob", "Bot") for each in due)
    assert "What was due" in (tmp_path / "shift.html").read_text()


def test_the_shift_has_what_the_first_robot_understood_and_every_robots_team(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It counted all that was said as understood, whatever was lost."""
    shifts = []
    for seed in "1234":  # some 30 sentences each
        hours(tmp_path, "--hours", "24", "--loss", "0.3", "--json", "--seed", seed)
        shifts.append(json.loads(capsys.readouterr().out))
    garbled, heard = (sum(shift[key] for shift in shifts) for key in ("garbled", "heard"))
    assert 0.2 < garbled / (heard + garbled) < 0.4
    assert all({member["team"] for member in shift["members"]} == {"plant"} for shift in shifts)
    sure = {member["confidence"] for shift in shifts for member in shift["members"]}
    assert sure == {None}, "words without sound are heard with no confidence; it said 100 %"


def test_what_cannot_be_done_is_told_before_it_begins(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """That was told of missions in sound alone; and of a revoked robot in none."""
    tasks, key = tmp_path / "tasks.yaml", tmp_path / "team.key"
    tasks.write_text("tasks:\n- {number: 1, name: lift the table, robots: 2, actions: [{wait: 1}]}\n")
    team = ["simulate", "--tasks", str(tasks), "--robots", "Rob,Bot"]
    main([*team, "--mode", "coordinate", "--hours", "0.1"])
    assert f"hvcpctl: warning: {tasks}: task 1" in capsys.readouterr().err
    write_key_file(key, KeyFile((fresh_entry(today()),)).with_revoked("bot"), replaces=False)
    assert main([*team, "--key", str(key), "--report", "/dev/null/none"]) == 2
    assert f"hvcpctl: warning: Bot is revoked in {key}: nobody believes what it says" in capsys.readouterr().err


def test_where_the_report_is_written_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hours(tmp_path, "--hours", "1", "--report", str(tmp_path / "day"))
    assert f"\nReport: {tmp_path}/day/shift.html (open it in a browser)\n" in capsys.readouterr().out


def test_robots_are_of_the_team_that_the_settings_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = tmp_path / "hvcpd.yaml"
    settings.write_text("{name: Rob, team: school, teams: [school, garden], names: [Rob, Bot]}")
    assert hours(tmp_path, "--config", str(settings), "--hours", "3", "--json") == 0
    members = json.loads(capsys.readouterr().out)["members"]
    assert {member["team"] for member in members} == {"school"}


def test_robots_talk_as_much_as_the_settings_say_if_no_option_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = tmp_path / "hvcpd.yaml"
    settings.write_text("name: Rob\ntalk: full\n", encoding="utf-8")

    def said(*options: str) -> int:
        hours(tmp_path, "--hours", "1", "--json", *options)
        return int(json.loads(capsys.readouterr().out)["said"])

    full, normal = said("--talk", "full"), said()
    assert full > normal
    assert said("--config", str(settings)) == full
    assert said("--config", str(settings), "--talk", "normal") == normal


def test_the_settings_robot_does_what_they_say_it_can(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It did tasks that it cannot do, and picked tasks where the settings have it give orders."""
    settings = tmp_path / "hvcpd.yaml"

    def deeds(text: str, *options: str) -> tuple[int, set[tuple[int, str]], str]:
        settings.write_text(f"name: Rob\n{text}\n", encoding="utf-8")
        status = hours(tmp_path, "--config", str(settings), "--hours", "24", "--json", *options)
        out, err = capsys.readouterr()
        return status, {(each["task"], by) for each in json.loads(out)["due"] for _, by in each["deeds"]}, err

    assert {"Rob", "Bot"} == {by for _, by in deeds("")[1]}
    assert not deeds("unable: [1, 2]")[1] & {(1, "Rob"), (2, "Rob")}
    assert {by for _, by in deeds("mode: coordinate")[1]} == {"Bot"}
    assert {by for _, by in deeds("mode: follow")[1]} == {"Rob"}
    assert {"Rob", "Bot"} == {by for _, by in deeds("mode: coordinate", "--mode", "volunteer")[1]}
    status, done, err = deeds("unable: [3]", "--robots", "Rob")
    assert (status, {number for number, _ in done}) == (1, {1, 2})
    assert "warning: task 3, 'sweep the long floor': what Rob cannot do leaves no robot to do it" in err


def test_a_robot_without_wheels_or_a_clock_is_one_in_a_day_too(tmp_path: Path) -> None:
    tasks, settings = tmp_path / "tasks.yaml", tmp_path / "hvcpd.yaml"
    place = "place: {x_m: -4, y_m: -4}, actions: [go to place]"
    tasks.write_text(f"tasks: [{{number: 1, name: look at the rose, every: 6 h, {place}}}]\n")
    settings.write_text("name: Rob\nwheels: {driver: none}\nclock: false\n")
    options = make_parser().parse_args(["simulate", "--config", str(settings), "--tasks", str(tasks), "--hours", "1"])
    options.robots, options.talk = ("Rob", "Bot"), "normal"
    plan = day_plan(options, load_team(options, options.robots), None, Speech())
    assert (plan.unable["Rob"], plan.unable["Bot"]) == ({1}, frozenset())
    assert plan.clocks == {"Bot": 0.0}


def test_places_that_a_day_leaves_out_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Robots drove through them unasked, without a word of it."""
    tap = "places: [{name: tap, centre: {x_m: 4.0, y_m: 0.0}, radius_m: 0.5}]\n"
    (tmp_path / "places.yaml").write_text(tap + TASKS)
    main(["simulate", "--hours", "0.1", "--tasks", str(tmp_path / "places.yaml"), "--robots", "Rob,Bot"])
    assert "note: with --hours robots drive through tap unasked" in capsys.readouterr().err


def test_what_is_not_there_cannot_be_taken_away_and_a_time_of_nothing_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert hours(tmp_path, "--hours", "1", "--without", "Bob=pour") == 2
    assert "Bob does not take part; did you mean 'Rob'?" in capsys.readouterr().err
    (tmp_path / "later.yaml").write_text(TASKS.splitlines()[0] + "\n" + TASKS.splitlines()[1] + "\n")
    assert main(["simulate", "--hours", "1", "--tasks", str(tmp_path / "later.yaml")]) == 0
    assert "note: within 1 h of Monday, 00:00, nothing is due" in capsys.readouterr().err


def test_without_an_option_the_settings_robots_take_part(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It took Rob and Bot, whoever the team was."""
    (tmp_path / "tasks.yaml").write_text(TASKS)
    settings = tmp_path / "hvcpd.yaml"
    settings.write_text("name: Ada\nnames: [Leo, Zoe]\ntasks: tasks.yaml\n", encoding="utf-8")
    main(["simulate", "--hours", "1", "--json", "--config", str(settings)])
    shift = json.loads(capsys.readouterr().out)
    assert {member["name"] for member in shift["members"]} == {"Ada", "Leo", "Zoe"}


@pytest.mark.parametrize("option", ["--mute", "--noise-db 90", "--room open", "--speed real", "--tank 1", "--key"])
def test_options_about_sound_are_refused(option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A day at 90 dB of noise ended as one in quiet does."""
    assert hours(tmp_path, "--hours", "1", *option.split()) == 2
    assert f"leave out {option.split()[0]}" in capsys.readouterr().err


def test_loss_is_refused_where_there_is_sound(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert hours(tmp_path, "--loss", "0.1") == 2
    assert "add --hours" in capsys.readouterr().err


@pytest.mark.parametrize(("robots", "is_told"), [("Rob", True), ("Rob,Bot", False)])
def test_it_says_that_nobody_knows_when_tasks_are_due(
    robots: str, is_told: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """They were not done, without a word of why."""
    (tmp_path / "hvcpd.yaml").write_text("{name: Rob, names: [Rob, Bot], clock: false}")
    assert hours(tmp_path, "--hours", "1", "--config", str(tmp_path / "hvcpd.yaml"), "--robots", robots) != 2
    assert ("no robot here has a clock" in capsys.readouterr().err) is is_told


def test_what_became_of_each_time() -> None:
    begin_s = 36_000.0
    deeds = [(begin_s + at_s, 1, "Rob") for at_s in (10.0, 3600.0 + 700.0, 7200.0 - 60.0, 7200.0 + 30.0)]
    end_s = begin_s + 4 * 3600.0 + JUST_DUE_S / 2
    became = [each.became for each in occurrences([HOURLY], deeds, begin_s, end_s)]
    assert became == ["done", "done late", "done more than once", "not done", "to be done"]


def test_what_is_done_just_before_it_is_due_again_was_done_late() -> None:
    """A task that robots were always late with was told as not done, and done more than once."""
    deeds = [(3600.0 * k - 60.0, 1, "Rob") for k in (1, 2, 3)]
    found = occurrences([HOURLY], deeds, 0.0, 3 * 3600.0)
    assert [(each.became, each.deeds) for each in found] == [("done late", ((at_s, "Rob"),)) for at_s, *_ in deeds]
    pairs = [(3480.0, 1, "Rob"), (3500.0, 1, "Bot"), (3600.0, 1, "Rob"), (3600.0, 1, "Bot")]
    found = occurrences([replace(HOURLY, robots=2)], pairs, 0.0, 2 * 3600.0)
    assert [each.became for each in found] == ["done late", "done"]


def test_what_is_done_once_was_due_at_the_beginning() -> None:
    (only,) = occurrences([replace(HOURLY, every=None)], [(50.0, 1, "Bot")], 40.0, 4000.0)
    assert only == Occurrence(1, "look", 40.0, 640.0, True, ((50.0, "Bot"),))


def test_what_takes_two_is_done_when_both_have_done_it() -> None:
    task = replace(HOURLY, robots=2)
    deeds = [
        (10.0, 1, "Rob"),
        (12.0, 1, "Bot"),
        (3610.0, 1, "Rob"),
        (7210.0, 1, "Rob"),
        (7212.0, 1, "Bot"),
        (7300.0, 1, "Rob"),
    ]
    became = [each.became for each in occurrences([task], deeds, 0.0, 3 * 3600.0)]
    assert became == ["done", "not done", "done more than once"]


def test_what_is_done_on_demand_is_never_due() -> None:
    assert occurrences([replace(HOURLY, every=None, on_demand=True)], [], 0.0, 4000.0) == ()


def test_a_team_too_small_for_a_task_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "tasks.yaml"
    path.write_text("tasks:\n  - {number: 1, name: carry the long table, actions: [{wait: 5}], robots: 2}\n")
    command = ["simulate", "--hours", "1", "--tasks", str(path), "--robots"]
    assert main([*command, "Rob"]) == 2
    assert "the task takes 2 robots, and the team has 1" in capsys.readouterr().err
    assert main([*command, "Rob,Bot"]) == 0


def test_tasks_for_which_skills_were_taken_from_too_many_robots_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A mission ended with "not done", without a word of why."""
    doing = "actions: [{wait: 1}, wave]"
    tasks = f"skills: {{wave: {{}}}}\ntasks:\n  - {{number: 1, name: greet the visitor, {doing}}}\n"
    path = tmp_path / "tasks.yaml"
    command = ["simulate", "--hours", "1", "--tasks", str(path), "--robots", "Rob,Bot", "--without", "Rob=wave"]
    both = [*command, "--without", "Bot=wave"]
    told = []
    for robots, options in (("1", command), ("1", both), ("2", command)):
        path.write_text(tasks.replace(", actions", f", robots: {robots}, actions"))
        main(options)
        told.append([line for line in capsys.readouterr().err.splitlines() if "warning" in line])
    warning = "hvcpctl: warning: task 1, 'greet the visitor': --without leaves"
    assert told == [[], [f"{warning} no robot to do it"], [f"{warning} 1 robot of 2 to do it"]]
