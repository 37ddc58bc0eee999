"""Tasks that can be carried out, and may not be what their author meant."""

import pytest

from hvcpd.config.task_doubts import doubts
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import (
    Action,
    Forward,
    GoTo,
    Place,
    SayAction,
    TaskDefinition,
    TaskRepository,
    Tend,
    Turn,
    Wait,
    default_tasks_path,
)

PLACE, ELSEWHERE = Place(1.0, 2.0), Place(3.0, 2.0)
SAY = SayAction("Hi all, I am Rob")


def told(*actions: Action, place: Place | None = PLACE) -> list[str]:
    return list(doubts(TaskRepository((TaskDefinition(3, "greet the door", place, actions),))))


def test_the_papers_tasks_are_beyond_doubt() -> None:
    assert doubts(load_tasks(default_tasks_path())) == ()


@pytest.mark.parametrize(("followers", "n_told"), [(None, 0), (1, 1), (2, 0)])
def test_a_task_for_more_robots_than_follow_orders(followers: int | None, n_told: int) -> None:
    """A coordinator with one follower called for half an hour, and the follower waited for orders."""
    task = TaskDefinition(3, "carry the table", PLACE, (GoTo(PLACE), Wait(5.0)), robots=2)
    texts = doubts(TaskRepository((task,)), followers)
    assert [("it takes 2 robots" in text, "has 1 to send" in text) for text in texts] == [(True, True)] * n_told


@pytest.mark.parametrize("actions", [(SAY,), (Wait(5.0),), (Tend(5.0),), (GoTo(ELSEWHERE), Tend(5.0))])
def test_a_place_that_no_action_leads_to(actions: tuple[Action, ...]) -> None:
    [text] = told(*actions)
    assert text.startswith("task 3, 'greet the door': it has a place, but no action leads there; ")
    assert "`go to place`" in text


@pytest.mark.parametrize("actions", [(Tend(5.0), GoTo(PLACE)), (SAY, Wait(1.0), Turn(90.0), GoTo(PLACE))])
def test_all_is_done_before_it_is_there(actions: tuple[Action, ...]) -> None:
    [text] = told(*actions)
    assert "before it goes to its place" in text


@pytest.mark.parametrize("action", ["water", "wait", "forward", "turn"])
def test_an_action_of_no_amount(action: str) -> None:
    kinds = {"water": Tend(0.0), "wait": Wait(0.0), "forward": Forward(0.0), "turn": Turn(0.0)}
    [text] = told(GoTo(PLACE), kinds[action], kinds[action], SAY)
    assert f"`{action}: 0` does nothing" in text


@pytest.mark.parametrize(
    "actions",
    [(GoTo(PLACE),), (SAY, GoTo(PLACE), Tend(5.0)), (GoTo(PLACE), SAY, GoTo(ELSEWHERE)), (GoTo(PLACE), Turn(90.0))],
)
def test_nothing_is_wrong_with_these(actions: tuple[Action, ...]) -> None:
    assert told(*actions) == []


def test_a_task_without_a_place_is_done_where_the_robot_is() -> None:
    assert told(SAY, place=None) == []
    assert told(Tend(5.0), place=None) == []
