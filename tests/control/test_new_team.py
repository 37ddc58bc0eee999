"""A new team from options or answers: what is written is what robots take, and wrong words are told before."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from hvcpd.config.settings_file import load_settings
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import Dock, GoTo, Place, Use, Wait
from hvcpd.control.cli import main
from hvcpd.control.simulate.new_team import (
    Console,
    SkillAnswer,
    read_robots,
    read_skill,
    read_skills,
    read_task,
    run,
    tasks_of,
)
from hvcpd.errors import ConfigError
from tests.control.conftest import Ran

THIRTEEN = ("Rob", "Bot", "Ada", "Max", "Zoe", "Tina", "Emma", "Kevin", "Anna", "Leo", "Gus", "Ivy", "Oscar")
GARDEN = ("--robots", "Rob,Bot", "--skill", "pour litres", "--no-demo")


def test_options_become_a_team_that_robots_take(tmp_path: Path, capsys: pytest.CaptureFixture[str], ran: Ran) -> None:
    folder = tmp_path / "garden"
    tasks = ("--task", "water the green rose; -3, -4; pour 0.2", "--task", "count the empty chairs; dock")
    assert f"hvcpctl simulate --config {folder}/hvcpd.yaml" in ran("new-team", folder, *GARDEN, *tasks)
    settings = load_settings(folder / "hvcpd.yaml", environment={})
    assert (settings.name, settings.names) == ("Rob", ("Rob", "Bot"))
    rose, chairs = load_tasks(settings.tasks).tasks
    assert (rose.name, rose.actions) == (
        "water the green rose",
        (GoTo(Place(-3.0, -4.0)), Use("pour", (("litres", 0.2),))),
    )
    assert chairs.actions == (Dock(),)
    assert main(["new-team", str(folder), *GARDEN, *tasks]) == 2
    assert "is there already; name another folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("tasks", "said"),
    [
        (("water the green rose", "water the green rows"), "tasks.yaml:"),
        (("water", "rest"), "has 2 to 8 words"),
        ((), "this is not a terminal"),
    ],
)
def test_words_that_cannot_be_used_are_told_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], tasks: tuple[str, ...], said: str
) -> None:
    words = [word for task in tasks for word in ("--task", task)]
    assert main(["new-team", str(tmp_path / "garden"), *GARDEN, *words]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert "--allow-confusable" not in err, "this command has no such option"
    assert not (tmp_path / "garden").exists()


def test_a_person_is_asked_again_until_an_answer_is_right(tmp_path: Path) -> None:
    answers: Iterator[str] = iter(
        [
            "Rod, Hi",
            "Bot, Pot",
            "Rob, Zoe",
            "dock",
            "wave, wave hands",
            "wave",
            "",
            "greet the visitors; -4, -4; sing",
            "greet the visitors; -4, -4; wave",
            "feed the sheep",
            "feed the ship",
            "",
        ]
    )
    told: list[str] = []
    options = argparse.Namespace(folder=tmp_path / "hall", robots=None, skill=None, task=None, demo=False)
    assert run(options, Console(lambda _question: next(answers), told.append)) == 0
    assert sum(text.startswith("  ") for text in told) == 7
    assert [line[:14] for line in told[0].splitlines()] == ["  the name 'Ro", "  the name 'Hi"]
    assert "  give at least one task\n" in told
    assert "'feed the ship' sounds like 'feed the sheep'" in told[-1]
    assert "no robot has the skill 'sing'; write one of wait, water, dock, turn, forward, wave, or" in "".join(told)
    settings = load_settings(tmp_path / "hall" / "hvcpd.yaml", environment={})
    assert settings.names == ("Rob", "Zoe")
    task, sheep = load_tasks(settings.tasks).tasks
    assert task.actions == (GoTo(Place(-4.0, -4.0)), Use("wave"))
    assert sheep.name == "feed the sheep"


def test_an_input_that_ends_is_no_missing_terminal(tmp_path: Path) -> None:
    def ended(_question: str) -> str:
        raise EOFError

    options = argparse.Namespace(folder=tmp_path / "hall", robots=None, skill=None, task=None, demo=False)
    with pytest.raises(ConfigError, match="the input has ended"):
        run(options, Console(ended, lambda _text: None))


def test_the_command_that_is_shown_can_be_pasted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "my garden"
    assert main(["new-team", str(folder), *GARDEN, "--task", "count the empty chairs"]) == 0
    command = f"hvcpctl simulate --config '{folder}/hvcpd.yaml'"
    assert command in capsys.readouterr().out
    assert command in (folder / "tasks.yaml").read_text(encoding="utf-8")


def test_a_large_and_a_small_number_are_written_as_numbers() -> None:
    """1e+06 is a text in YAML, and a seventh digit was lost."""
    pour = SkillAnswer("pour", "millilitres")
    for text, place, amount in (("0.00001, 2", (0.00001, 2.0), 1e6), ("-0.5, 3", (-0.5, 3.0), 1234567.5)):
        task = read_task(f"count the empty chairs; {text}; pour {amount}", [pour], [])
        written = yaml.safe_load(tasks_of(Path(), [pour], [task]))["tasks"][0]
        assert (written["place"]["x_m"], written["place"]["y_m"]) == place
        assert written["actions"][1] == {"pour": amount}


def test_the_usual_deed_is_to_wait() -> None:
    task = read_task("count the empty chairs", [], [])
    assert (task.place, task.deed, task.amount) == (None, "wait", 5.0)
    assert read_task("count the empty chairs; 1, .5", [], []).place == (1.0, 0.5)
    assert read_task("count the empty chairs; 1, .5; wait 5; ", [], []).place == (1.0, 0.5)
    assert Wait(5.0) == Wait(task.amount or 0.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("chairs", "2 to 8 words"),
        ("count the empty chairs; 1", "write x and y in metres"),
        ("count the empty chairs; 1, 99", "too far"),
        ("count the empty chairs; 1, x", "'x' is not a number"),
        ("count the empty chairs; nan, 1; wait 5", "'nan' is not a number"),
        ("count the empty chairs; pour", "'pour' takes a number; write pour 5 (litres)"),
        ("count the empty chairs; dock 3", "'dock' takes no number; write dock"),
        ("count the empty chairs; wait inf", "not a number"),
        ("count the empty chairs; wait 5; wait 6", "is too much"),
    ],
)
def test_a_task_that_is_written_wrong_has_its_remedy(text: str, said: str) -> None:
    with pytest.raises(ConfigError) as error:
        read_task(text, [SkillAnswer("pour", "litres")], [])
    assert said in str(error.value)


def test_names_and_skills_are_checked_at_once() -> None:
    for wrong in ("", "Rob, Rob", "R2-D2", "Hi", "Rob, Robb", "Bot, Pot", ", ".join(THIRTEEN)):
        with pytest.raises(ConfigError):
            read_robots(wrong)
    for wrong in ("Pour", "wait seconds", "pour Litres", "on", "pour off", "null"):
        with pytest.raises(ConfigError):
            read_skill(wrong)
    for repeated in (["pour litres", "pour jugs"], ["wave"] * 2):
        with pytest.raises(ConfigError, match="already; choose another name"):
            read_skills(repeated)
    with pytest.raises(ConfigError, match="at most 30 skills"):
        read_skills([f"wave_{k}" for k in range(31)])
