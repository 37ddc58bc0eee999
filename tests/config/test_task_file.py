"""Task repositories: what they mean, and every fault told at its line."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.config.icons import ICONS
from hvcpd.config.names import valid_task_name
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
from hvcpd.config.written import unsayable
from hvcpd.errors import ConfigError
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.likeness import sounds_alike

LEXICON = Lexicon.load()


def alike(a: str, b: str) -> bool:
    return sounds_alike(a, b, LEXICON)


def load(tmp_path: Path, text: str) -> TaskRepository:
    path = tmp_path / "tasks.yaml"
    path.write_text(text)
    return load_tasks(path, alike)


def faults(tmp_path: Path, text: str) -> list[str]:
    with pytest.raises(ConfigError) as error:
        load(tmp_path, text)
    return [line.replace(str(tmp_path / "tasks.yaml"), "F") for line in str(error.value).splitlines()]


def test_the_default_is_the_papers_five_plants() -> None:
    tasks = load_tasks(default_tasks_path(), alike).tasks
    assert {task.number: (task.name, task.place) for task in tasks} == {
        1: ("water the green rose", Place(4.17, 0.95)),
        2: ("water the violet rose", Place(4.50, -1.71)),
        3: ("water the indigo rose", Place(4.25, 3.68)),
        4: ("water the orange rose", Place(6.32, -1.60)),
        5: ("water the yellow rose", Place(-0.45, 1.49)),
    }
    assert all(isinstance(task.actions[0], GoTo) and task.actions[0].place == task.place for task in tasks)
    assert {task.icon for task in tasks} == {"flower"}
    assert all(any(isinstance(action, Tend) for action in task.actions) for task in tasks)


def test_the_installed_copy_is_the_packaged_one() -> None:
    installed = Path(__file__).parents[2] / "etc" / "tasks.yaml"
    assert load_tasks(installed) == load_tasks(default_tasks_path())


def test_every_kind_of_action(tmp_path: Path) -> None:
    text = """
    tasks:
    - number: 7
      name: fetch the ball
      place: {x_m: 1, y_m: -2.5}
      actions: [go to place, {go to: {x_m: 3, y_m: 4}}, {forward: -0.5}, {turn: 90}, {wait: 2}, {water: 5},
                {say: "Hi all"}]
    other_tasks: [guard the door]
    """
    repository = load(tmp_path, text)
    assert repository.other_tasks == ("guard the door",)
    assert repository.by_number(7) is repository.tasks[0] is repository.by_name("fetch the ball")
    assert repository.by_number(8) is None
    assert repository.tasks[0].actions == (
        GoTo(Place(1.0, -2.5)),
        GoTo(Place(3.0, 4.0)),
        Forward(-0.5),
        Turn(90.0),
        Wait(2.0),
        Tend(5.0),
        SayAction("Hi all"),
    )


def task(more: str = "", number: object = 1, name: str = "fetch the ball", actions: str = "[{wait: 1}]") -> str:
    return f"- {{number: {number}, name: {name}, actions: {actions}{more}}}\n"


@pytest.mark.parametrize(
    ("text", "place", "part"),
    [
        ("", "F:1", "the key 'tasks' is missing"),
        ("tasks: []\n", "F:1", "a task file has 1 to 99 tasks, found 0; add one"),
        ("tasks: 5\n", "F:1", "expected a list"),
        ("taks:\n" + task(), "F:1", "did you mean 'tasks'?"),
        ("tasks:\n" + task(", colour: red"), "F:2", "unknown key 'colour'"),
        ("tasks:\n" + task() + task(name="guard the door"), "F:3", "task number 1 is taken in line 2 already"),
        ("tasks:\n" + task() + task(number=2), "F:3", "the task name 'fetch the ball' is taken in line 2"),
        ("tasks:\n" + task() + task(number=2, name="fetch the bowl"), "F:3", "sounds like 'fetch the ball' in line 2"),
        ("tasks:\n" + task() + "other_tasks: [fetch the bawl]\n", "F:3", "sounds like 'fetch the ball'"),
        ("tasks:\n" + task(number=0), "F:2", "from 1 to 99"),
        ("tasks:\n" + task(number=100), "F:2", "from 1 to 99"),
        ("tasks:\n" + task(number="'1'"), "F:2", "expected a whole number"),
        ("tasks:\n" + task(name="fetch"), "F:2", "a task name has 2 to 8 words"),
        ("tasks:\n" + task(name="fetch ball 2"), "F:2", "write numbers as words"),
        ("tasks:\n" + task(name="Fetch the Ball"), "F:2", "write for example 'fetch the ball'"),
        ("tasks:\n" + task(actions="[]"), "F:2", "a task has 1 to 100 actions"),
        ("tasks:\n" + task(actions="[go to place]"), "F:2", "this task has no place"),
        ("tasks:\n" + task(actions="[wait]"), "F:2", "'wait' is not an action by itself; write {wait: …}"),
        ("tasks:\n" + task(actions="[wait 5 s]"), "F:2", "'wait 5 s' is not an action by itself; write {wait: 5}"),
        ("tasks:\n" + task(actions="['wait:5']"), "F:2", "'wait:5' is not an action by itself; write {wait: 5}"),
        ("tasks:\n" + task(actions="[{wait:5}]"), "F:2", "unknown action 'wait:5'; write {wait: 5} ("),
        ("tasks:\n" + task(number="08"), "F:2", "write it without quotes, and without a zero before it"),
        (
            "tasks:\n" + task(name=f"fetch {'a' * 21}"),
            "F:2",
            "has 21 letters, and a word has 20 at most; choose another",
        ),
        ("tasks:\n" + task(name="fetch th\u0435 ball"), "F:2", "has the character CYRILLIC SMALL LETTER IE; write"),
        ("tasks:\n" + task(name="\u201cfetch the ball\u201d"), "F:2", "write for example 'fetch the ball'"),
        ("tasks:\n" + task(", place: {x_m:1, y_m: 2}"), "F:2", "put a space after the colon: `x_m: 1`"),
        ("tasks:\n" + task(actions="[{wat: 1}]"), "F:2", "did you mean 'wait'?"),
        ("tasks:\n" + task(actions="[{wait: 601}]"), "F:2", "from 0 to 600"),
        ("tasks:\n" + task(actions="[{turn: north}]"), "F:2", "expected a number"),
        ("tasks:\n" + task(actions="[{go to: {x_m: 1}}]"), "F:2", "the key 'y_m' is missing"),
        ("tasks:\n" + task(actions="[{go to: {x_m: 1, y_m: 51}}]"), "F:2", "from -50 to 50"),
        ("tasks:\n" + task(actions="[{wait: 1, turn: 2}]"), "F:2", "expected one action"),
        ("tasks:\n" + task(actions="[{say: ''}]"), "F:2", "a sentence has 1 to 200 characters"),
        ("tasks:\n" + task(", icon: flour"), "F:2", "'flour' is not an icon; did you mean 'flower'?"),
        ("tasks:\n" + task(", icon: ''"), "F:2", "'' is not an icon; known are: flower, book"),
        ("tasks:\n" + task(", icon: 7"), "F:2", "expected text, found the number 7"),
        ("tasks:\n" + task(", place: here"), "F:2", "expected a group of keys (x_m, y_m)"),
        ("tasks:\n" + task() + "other_tasks: [Guard it]\n", "F:3", "'guard it'"),
    ],
)
def test_faults(text: str, place: str, part: str, tmp_path: Path) -> None:
    lines = faults(tmp_path, text)
    hits = [line for line in lines if part in line]
    assert len(hits) == 1, lines
    assert hits[0].startswith(f"{place}: ")


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    text = "tasks:\n" + task(number=0) + task(name="one") + task(actions="[fly]") + "bogus: 1\n"
    lines = faults(tmp_path, text)
    assert {line.split(": ")[0] for line in lines} == {"F:2", "F:3", "F:4", "F:5"}


def test_a_hundred_tasks_are_too_many(tmp_path: Path) -> None:
    text = "tasks:\n" + "".join(task(number=n % 99 + 1) for n in range(100))
    assert "F:1: tasks: a task file has 1 to 99 tasks, found 100; remove some" in faults(tmp_path, text)


words = st.from_regex(r"[a-z]{1,12}", fullmatch=True)
phrases = st.lists(words, min_size=2, max_size=8).map(" ".join)
metres = st.floats(-50, 50)
places = st.builds(Place, metres, metres)
actions = st.one_of(
    st.builds(GoTo, places),
    st.builds(Forward, metres),
    st.builds(Turn, st.floats(-360, 360)),
    st.builds(Wait, st.floats(0, 600)),
    st.builds(Tend, st.floats(0, 600)),
    st.builds(
        SayAction,
        st.text("abc XYZ019,.!'éß", min_size=1, max_size=200).filter(lambda text: text.strip() and not unsayable(text)),
    ),
)


@st.composite
def repositories(draw: st.DrawFn) -> TaskRepository:
    names = draw(st.lists(phrases, min_size=1, max_size=5, unique=True))
    numbers = draw(st.lists(st.integers(1, 99), min_size=len(names), max_size=len(names), unique=True))
    tasks = [
        TaskDefinition(
            number,
            name,
            draw(st.none() | places),
            draw(st.lists(actions, min_size=1, max_size=5).map(tuple)),
            draw(st.sampled_from(["", *ICONS, "★", "📚"])),
        )
        for number, name in zip(numbers, names, strict=True)
    ]
    others = draw(st.lists(phrases.filter(lambda name: name not in names), max_size=3, unique=True))
    return TaskRepository(tuple(tasks), tuple(others))


def _plain_action(action: Action) -> dict[str, Any]:
    match action:
        case GoTo(place):
            return {"go to": {"x_m": place.x_m, "y_m": place.y_m}}
        case Forward(distance_m):
            return {"forward": distance_m}
        case Turn(angle_deg):
            return {"turn": angle_deg}
        case Tend(duration_s):
            return {"water": duration_s}
        case Wait(duration_s):
            return {"wait": duration_s}
        case SayAction(text):
            return {"say": text}
        case _:
            raise AssertionError(f"not drawn: {action}")


def _plain(repository: TaskRepository) -> dict[str, Any]:
    return {
        "tasks": [
            {
                "number": task.number,
                "name": task.name,
                "actions": [_plain_action(action) for action in task.actions],
            }
            | ({"icon": task.icon} if task.icon else {})
            | ({"place": {"x_m": task.place.x_m, "y_m": task.place.y_m}} if task.place else {})
            for task in repository.tasks
        ],
        "other_tasks": list(repository.other_tasks),
    }


@given(repositories())
@settings(max_examples=40)
def test_whatever_is_valid_survives_being_written_and_read(repository: TaskRepository) -> None:
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "tasks.yaml"
        path.write_text(yaml.safe_dump(_plain(repository)), encoding="utf-8")
        assert load_tasks(path) == repository


ONE = "tasks:\n  - {number: 1, name: water the indigo rose, actions: [{wait: 1}]}\n"


def test_phrases_may_count_as_a_word(tmp_path: Path) -> None:
    repository = load(tmp_path, ONE + "alternatives:\n  indigo: [in the go, indie go]\n  rose: [rows]\n")
    assert repository.alternatives == (("indigo", "in the go"), ("indigo", "indie go"), ("rose", "rows"))
    assert load(tmp_path, ONE).alternatives == ()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("alternatives: [in the go]\n", "F:3: alternatives: expected words and their alternatives, found a list;"),
        (
            "alternatives:\n  indigo: in the go\n",
            "F:4: expected a list of phrases, found the text 'in the go'; write it",
        ),
        (
            "alternatives:\n  indigo: []\n",
            "F:4: expected a list of phrases, found an empty list; write it as",
        ),
        ("alternatives:\n  indigo: [5]\n", "F:4: the number 5 is not a phrase"),
        ("alternatives:\n  indigo: [In the go]\n", "F:4: the alternative 'In the go' is not words of the letters a-z"),
        ("alternatives:\n  indigo: [i n t o]\n", "F:4: an alternative has 1 to 3 words, 'i n t o' has 4; shorten it"),
        ("alternatives:\n  In: [in]\n", "F:4: 'In' is not one lower-case word of the letters a-z; write it as in the"),
        ("alternatives:\n  indigo: [rows]\n  rose: [rows]\n", "F:5: 'rows' already counts as 'indigo' (line 4); leave"),
        ("alternative:\n  indigo: [rows]\n", "F:3: unknown key 'alternative'; did you mean 'alternatives'?"),
    ],
)
def test_alternatives_are_read_strictly(tmp_path: Path, text: str, expected: str) -> None:
    [fault] = faults(tmp_path, ONE + text)
    assert fault.startswith(expected)


@pytest.mark.parametrize(
    ("action", "fault"),
    [
        ("{wait: -3}", "wait: the number -3.0 is out of range; give a number from 0 to 600"),
        ("{water: 9999}", "water: the number 9999.0 is out of range"),
        ("{forward: 999}", "forward: the number 999.0 is out of range"),
        ("{turn: x}", "turn: expected a number, found the text 'x'"),
        ("{say: ''}", "say: a sentence has 1 to 200 characters"),
        ("{say: Hi 日本}", "say: '日' cannot be said"),
        ("{say: it is 1/2 m long}", "say: '/' cannot be said"),
        ("{go to: 3}", "go to: expected a group of keys"),
    ],
)
def test_a_fault_of_an_action_names_the_action(tmp_path: Path, action: str, fault: str) -> None:
    path = tmp_path / "tasks.yaml"
    path.write_text(f"tasks:\n- {{number: 1, name: fetch the ball, actions: [{action}]}}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as raised:
        load_tasks(path)
    assert f"{path}:2: {fault}" in str(raised.value)


@pytest.mark.parametrize(
    ("name", "proposal"),
    [
        ("fetch the café book", "fetch the cafe book"),
        ("Müller Straße", "muller strasse"),
        ("Don't touch the vase", "do not touch the vase"),
        ("say what you can't do", "say what you cannot do"),
        ("water the rose's leaves", "water the roses leaves"),
    ],
)
def test_a_proposed_name_maims_no_word(tmp_path: Path, name: str, proposal: str) -> None:
    assert f"write for example {proposal!r}" in str(valid_task_name(name))
    assert valid_task_name(proposal) is None


def test_a_name_in_another_script_gets_no_proposal_that_maims_it() -> None:
    assert "write for example" not in str(valid_task_name("fetch 日本 now please"))


def test_the_example_explains_each_thing_once() -> None:
    lines = [line for line in default_tasks_path().read_text(encoding="utf-8").splitlines() if len(line) > 40]
    assert len(lines) == len(set(lines))


def test_a_number_that_yaml_takes_for_a_text_is_told_with_its_form(tmp_path: Path) -> None:
    found = faults(tmp_path, ONE.replace("actions", "place: {x_m: 1e1, y_m: two}, actions"))
    assert found[0].endswith("x_m: expected a number, found the text '1e1'; write 1.0e+01, with a dot and a sign")
    assert found[1].endswith("write it without quotes or unit, as 1.5")


@pytest.mark.parametrize(
    ("parameter", "said"),
    [
        ("{least: 3, most: 2}", "`least` 3 is more than `most` 2; exchange them"),
        ("{type: text, most: 2}", "`least` and `most` are of numbers; leave out `type: text`, or give `choices`"),
        ("{choices: [a]}", "choices are of texts; add `type: text`, or give `least` and `most`"),
    ],
)
def test_a_parameter_that_no_value_fits_is_refused(tmp_path: Path, parameter: str, said: str) -> None:
    found = faults(tmp_path, f"skills:\n  pour: {{parameters: {{litres: {parameter}}}}}\n{ONE}")
    assert found == [f"F:2: litres: {said}"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Grip", "Grip: 'Grip' is not a lower-case letter"),
        ("dock", "dock: every robot can do this; choose another name"),
    ],
)
def test_a_skill_with_a_wrong_name_is_told_at_its_line(name: str, said: str, tmp_path: Path) -> None:
    """The line was that of `skills:`."""
    (found,) = faults(tmp_path, f"skills:\n  pour: {{}}\n  {name}: {{}}\n{ONE}")
    assert found.startswith(f"F:3: {said}")


def test_a_skills_number_that_yaml_takes_for_a_text_is_told_with_its_form(tmp_path: Path) -> None:
    text = ONE.replace("actions: [", "actions: [{pour: 1e6}, ")
    (found,) = faults(tmp_path, f"skills:\n  pour: {{parameters: {{litres: {{}}}}}}\n{text}")
    assert found.endswith("litres: expected a number, found the text '1e6'; write 1.0e+06, with a dot and a sign")
