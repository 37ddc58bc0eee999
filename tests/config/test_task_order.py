"""Fields of a task file that say which task is due when, after which others, and by how many robots."""

from __future__ import annotations

from pathlib import Path

import pytest

from hvcpd.config.task_file import load_tasks
from hvcpd.errors import ConfigError
from tests.config.test_task_file import faults, load

THREE = "tasks:\n" + "".join(
    f"  - number: {n}\n    name: water the {colour} rose\n    actions: [{{wait: 1}}]\n    {{{n}}}\n"
    for n, colour in ((1, "green"), (2, "violet"), (3, "indigo"))
)


def three(*more: str) -> str:
    text = THREE
    for number, field in enumerate(more, 1):
        text = text.replace(f"{{{number}}}", field)
    return text


def test_what_is_urgent_and_what_comes_first_is_read(tmp_path: Path) -> None:
    tasks = load(tmp_path, three("priority: 2", "after: []", "after: [1, 2]\n    deadline: 30 min"))
    assert tasks.tasks[0].priority == 2
    assert (tasks.tasks[2].after, tasks.tasks[2].deadline_s) == (frozenset({1, 2}), 1800.0)


@pytest.mark.parametrize(
    ("after", "line", "circle"),
    [
        (("after: [1]", "after: []", "after: []"), 5, "task 1 after task 1"),
        (("after: [3]", "after: [1]", "after: [2]"), 5, "task 1 after task 3 after task 2 after task 1"),
        (("after: []", "after: [3]", "after: [1, 2]"), 9, "task 2 after task 3 after task 2"),
    ],
)
def test_tasks_in_a_circle_are_told_once_with_the_way_round(
    after: tuple[str, str, str], line: int, circle: str, tmp_path: Path
) -> None:
    (fault,) = faults(tmp_path, three(*after))
    assert fault == f"F:{line}: {circle}: none of them can begin; leave one of them out"


def test_a_task_comes_after_tasks_that_there_are(tmp_path: Path) -> None:
    (fault,) = faults(tmp_path, three("after: [7]", "", ""))
    assert "task 1 comes after task 7, which does not exist; leave 7 out" in fault


def test_a_deadline_is_a_time_and_a_priority_small(tmp_path: Path) -> None:
    told = faults(tmp_path, three("deadline: soon", "priority: 10", "after: one"))
    assert "write for example `30 min`" in told[0]
    assert "priority" in told[1]
    assert "after" in told[2]


@pytest.mark.parametrize(
    ("field", "found", "remedy"),
    [
        ("every: 6", "the number 6", "write for example `6 h`"),
        ("every: [6 h]", "a list", "write for example `6 h`"),
        ("deadline: 30", "the number 30", "write for example `30 min`"),
        ("deadline:", "nothing", "write for example `30 min`"),
    ],
)
def test_what_would_be_wrong_in_quotes_too_is_told_what_is_right(
    field: str, found: str, remedy: str, tmp_path: Path
) -> None:
    """ "Put it in quotes" led to the next fault."""
    (fault,) = faults(tmp_path, three(field, "", ""))
    assert fault.startswith(f"F:5: {field.split(':')[0]}: expected text, found {found}; {remedy}")


def test_a_comma_ends_a_sentence_that_is_not_in_quotes(tmp_path: Path) -> None:
    text = "tasks:\n- {number: 1, name: greet the visitor, actions: [{say: hello, friends}]}\n"
    (fault,) = faults(tmp_path, text)
    assert fault == "F:2: actions: expected one action, found 2; put text with a comma in quotes"


def test_a_task_takes_no_more_robots_than_the_team_has(tmp_path: Path) -> None:
    path = tmp_path / "tasks.yaml"
    path.write_text(three("robots: 2", "robots: 1", ""))
    assert [task.robots for task in load_tasks(path, robots=2).tasks] == [2, 1, 1]
    with pytest.raises(ConfigError, match="5: the task takes 2 robots, and the team has 1; write fewer, or name more"):
        load_tasks(path, robots=1)
    assert "robots" in faults(tmp_path, three("robots: 0", "", ""))[0]


def test_what_recurs_is_not_done_on_demand(tmp_path: Path) -> None:
    assert [t.on_demand for t in load(tmp_path, three("on_demand: true", "", "")).tasks] == [True, False, False]
    (fault,) = faults(tmp_path, three("on_demand: true\n    every: 6 h", "", ""))
    assert fault == "F:5: what recurs is due without being asked for; leave one of the two out"
