"""The words in which the transcript of a running robot is read."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pytest

from hvcpd.control.live.report import vocabulary_of
from hvcpd.control.live.transcript import AskedRows
from hvcpd.errors import PhraseError

TASKS = """tasks:
- {number: 1, name: make the tea, actions: [{say: the tea is ready}]}
"""


class Answering:
    """The other end of the socket: a robot with one task, of which it tells number, name and icon."""

    def __init__(self, task: str) -> None:
        self._task = {"number": 1, "name": task, "icon": ""}

    def ask(self, request: str, **_: object) -> dict[str, Any]:
        settings = [{"key": "names", "value": ["Rob", "Bot"]}, {"key": "teams", "value": ["plant"]}]
        return {"tasks": [self._task], "settings": settings}


@pytest.mark.parametrize(("task", "is_known"), [("make the tea", True), ("make the coffee", False)])
def test_it_has_all_words_of_the_settings_if_the_tasks_are_the_same(tmp_path: Path, task: str, is_known: bool) -> None:
    """A robot does not tell what its tasks have it say."""
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
