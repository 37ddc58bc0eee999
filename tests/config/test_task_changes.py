"""Tasks that were added to a task file, and taken out of it, in a file of the robot's own."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.config.task_changes import TaskChanges, read_changes
from hvcpd.config.task_file import load_tasks
from hvcpd.errors import ConfigError

FILE = """\
# A comment.
tasks:
- {number: 1, name: water the green rose, actions: [{wait: 1}]}
- {number: 2, name: water the pink rose, actions: [{wait: 1}]}
"""
TULIP = {"number": 11, "name": "water the red tulip", "actions": [{"wait": 2}]}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "tasks.yaml"
    path.write_text(FILE)
    return path


def numbers(file: Path, changes: TaskChanges) -> list[int]:
    return [task.number for task in load_tasks(file, changes=changes).tasks]


def kept(changes: TaskChanges, folder: Path) -> TaskChanges:
    """As they are read again."""
    path = folder / "kept.yaml"
    path.write_bytes(changes.text())
    return read_changes(path)


def test_without_a_file_nothing_is_changed(file: Path) -> None:
    assert numbers(file, read_changes(file.parent / "none.yaml")) == [1, 2]


def test_what_is_added_and_removed_is_so_after_it_was_read_again(file: Path) -> None:
    changes = TaskChanges().with_added(TULIP).without(1, "water the green rose")
    assert numbers(file, changes) == numbers(file, kept(changes, file.parent)) == [2, 11]
    again = kept(changes, file.parent).without(11, "water the red tulip")
    assert numbers(file, again) == [2]
    assert len(again.removed) == 1, "what was only added needs no note"


def test_a_fault_is_told_with_the_file_that_it_is_in(file: Path) -> None:
    changes = kept(TaskChanges().with_added(TULIP | {"number": 2}), file.parent)
    with pytest.raises(ConfigError, match=r"kept\.yaml:5: task number 2 is taken in line 4 of .*/tasks\.yaml"):
        load_tasks(file, changes=changes)
    file.write_text(FILE.replace("wait: 1}]}\n- ", "weight: 1}]}\n- "))
    with pytest.raises(ConfigError, match=r"tasks\.yaml:3: .*weight"):
        load_tasks(file, changes=TaskChanges().with_added(TULIP))
    assert numbers(file, TaskChanges().without(1, "water the green rose")) == [2]


def test_what_the_file_has_by_now_is_not_added_twice_and_a_new_task_not_removed(file: Path) -> None:
    changes = TaskChanges().with_added(TULIP).without(2, "water the pink rose")
    file.write_text(
        FILE.replace("pink rose", "white rose") + "- {number: 11, name: water the red tulip, actions: [dock]}\n"
    )
    assert numbers(file, changes) == [1, 2, 11]


@pytest.mark.parametrize("text", ["tasks: 3", "removed: [3]", "removed: [{number: x, name: y}]", "- 1", "tusks: []"])
def test_a_spoiled_file_is_told_with_its_line(file: Path, text: str) -> None:
    path = file.parent / "kept.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"kept\.yaml:1"):
        read_changes(path)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner, max_size=3),
    max_leaves=9,
)


@settings(max_examples=40)
@given(st.dictionaries(st.sampled_from(["number", "name", "actions", "place", "every", "x"]), JSON))
def test_whatever_a_client_sends_is_a_task_or_refused(
    tmp_path_factory: pytest.TempPathFactory, task: dict[str, object]
) -> None:
    file = tmp_path_factory.getbasetemp() / "tasks.yaml"
    file.write_text(FILE)
    try:
        changes = TaskChanges().with_added(task)
        tasks = load_tasks(file, changes=changes)
    except ConfigError:
        return
    assert load_tasks(file, changes=kept(changes, file.parent)) == tasks
