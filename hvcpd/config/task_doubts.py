"""Warnings about valid tasks: the author may have meant something else."""

from __future__ import annotations

from hvcpd.config.tasks import Forward, GoTo, SayAction, TaskDefinition, TaskRepository, Tend, Turn, Use, Wait


def doubts(tasks: TaskRepository, followers: int | None = None) -> tuple[str, ...]:
    """One warning for each oddity, in the order of the tasks, with the task and the remedy. `followers`: number of
    robots that can be sent to a task, where one of the team gives orders."""
    return tuple(
        f"task {task.number}, {task.name!r}: {text}" for task in tasks.tasks for text in _doubts(task, followers)
    )


def _doubts(task: TaskDefinition, followers: int | None) -> list[str]:
    found = []
    if followers is not None and task.robots > followers:
        remedy = "write fewer, name more robots, or have the team volunteer"
        found.append(f"it takes {task.robots} robots, and the one that gives orders has {followers} to send; {remedy}")
    if task.place is not None:
        way = GoTo(task.place)
        done = [k for k, action in enumerate(task.actions) if isinstance(action, Wait | SayAction | Use)]
        if way not in task.actions:
            remedy = "begin its actions with `go to place`, or leave `place` out"
            found.append(f"it has a place, but no action leads there; {remedy}")
        elif done and done[-1] < task.actions.index(way):
            found.append("it does everything before it goes to its place, and nothing there; put `go to place` first")
    idle = [_written(action) for action in task.actions if _does_nothing(action)]
    found += [f"`{action}` does nothing; leave it out, or write how much" for action in dict.fromkeys(idle)]
    return found


def _does_nothing(action: object) -> bool:
    match action:
        case Wait(amount) | Forward(amount) | Turn(amount):
            return amount == 0
        case _:
            return False


def _written(action: object) -> str:
    """An action of no amount, as the task file has it."""
    key = action.skill if isinstance(action, Tend) else type(action).__name__.lower()
    return f"{key}: 0"
