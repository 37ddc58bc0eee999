"""The words in which the transcript of a running robot is read."""

from __future__ import annotations

import argparse
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from hvcpd.control.live.report import vocabulary_of
from hvcpd.control.live.transcript import AskedRows
from hvcpd.errors import PhraseError
from hvcpd.memory.store import Store, TranscriptReader

TASKS = """tasks:
- {number: 1, name: make the tea, actions: [{say: the tea is ready}]}
"""


class Answering:
    """The other end of the socket: a robot with one task, of which it tells number, name and icon, and `more`."""

    def __init__(self, task: str, words: dict[str, list[str]] | None = None, **more: object) -> None:
        self._told: dict[str, Any] = {"tasks": [{"number": 1, "name": task, "icon": "", **more}]}
        self._told |= {"words": words} if words is not None else {}

    def ask(self, request: str, **_: object) -> dict[str, Any]:
        settings = [{"key": "names", "value": ["Rob", "Bot"]}, {"key": "teams", "value": ["plant"]}]
        return {**self._told, "settings": settings}


@pytest.mark.parametrize(("task", "is_known"), [("make the tea", True), ("make the coffee", False)])
def test_it_has_all_words_of_the_settings_if_the_tasks_are_the_same(tmp_path: Path, task: str, is_known: bool) -> None:
    """An older daemon does not tell what its tasks have it say."""
    (tmp_path / "tasks.yaml").write_text(TASKS)
    (tmp_path / "hvcpd.yaml").write_text("{name: Rob, names: [Rob, Bot], tasks: tasks.yaml}")
    options = argparse.Namespace(config=tmp_path / "hvcpd.yaml", tasks=None)
    book, (told,) = vocabulary_of(AskedRows(Answering(task)), [], options)
    assert told.name == task
    book.parse_text(f"Hi all, I am Rob, I will {task}")
    if is_known:
        book.parse_text("Hi all, I am Rob, the tea is ready")
    else:
        with pytest.raises(PhraseError):
            book.parse_text("Hi all, I am Rob, the tea is ready")


def test_a_robot_tells_all_words_of_its_own_tasks(tmp_path: Path) -> None:
    """What its skills failed for, and its places, were no sentences; a task that two did together was done twice."""
    (tmp_path / "tasks.yaml").write_text(TASKS)
    (tmp_path / "hvcpd.yaml").write_text("{name: Rob, names: [Rob, Bot], tasks: tasks.yaml}")
    options = argparse.Namespace(config=tmp_path / "hvcpd.yaml", tasks=None)
    words = {"remarks": ["dinner is ready"], "failures": ["the pot is empty"], "places": ["kitchen"]}
    book, (told,) = vocabulary_of(AskedRows(Answering("make the coffee", words, robots=2)), [], options)
    for text in ("dinner is ready", "task one failed, the pot is empty", "the kitchen is free"):
        book.parse_text(f"Hi all, I am Rob, {text}")
    assert told.robots == 2


def test_a_task_for_two_is_one_too_where_the_settings_have_it(tmp_path: Path) -> None:
    (tmp_path / "tasks.yaml").write_text(TASKS)
    (tmp_path / "hvcpd.yaml").write_text("{name: Rob, names: [Rob, Bot], tasks: tasks.yaml}")
    options = argparse.Namespace(config=tmp_path / "hvcpd.yaml", tasks=None)
    _, (told,) = vocabulary_of(AskedRows(Answering("make the tea", robots=2)), [], options)
    assert told.robots == 2


def test_a_memory_is_read_with_the_tasks_that_commands_gave_its_robot(tmp_path: Path) -> None:
    """The order to do one was no sentence once the robot was switched off, and the task had no name."""
    (tmp_path / "tasks.yaml").write_text(TASKS)
    (tmp_path / "hvcpd.yaml").write_text("{name: Rob, names: [Rob, Bot], tasks: tasks.yaml}")
    (tmp_path / "rob.tasks.yaml").write_text(
        "removed: [{number: 1, name: make the tea}]\n"
        "tasks: [{number: 2, name: make the coffee, actions: [{wait: 1}]}]\n"
    )
    Store(tmp_path / "rob.sqlite3").close()
    options = argparse.Namespace(config=tmp_path / "hvcpd.yaml", tasks=None)
    with closing(TranscriptReader(tmp_path / "rob.sqlite3")) as reader:
        book, (told,) = vocabulary_of(reader, [], options)
        assert told.name == "make the coffee"
        book.parse_text("Hi Rob, I am Bot, make the coffee")
        options.tasks = tmp_path / "tasks.yaml"
        assert [task.name for task in vocabulary_of(reader, [], options)[1]] == ["make the tea"], "those that are named"
