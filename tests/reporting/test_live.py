"""The terminal view: on a terminal of any width, in a pipe, and whatever the events are."""

from __future__ import annotations

import io
import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.cells import cell_len
from rich.console import Console

from hvcpd.ports import Pose
from hvcpd.reporting import events as ev
from hvcpd.reporting.html import page
from hvcpd.reporting.live import LiveView
from hvcpd.reporting.story import Line
from hvcpd.reporting.watching import PATIENCE_S, Watch
from tests.reporting.example import example
from tests.reporting.shown import Page
from tests.reporting.test_html import HOSTILE

pytestmark = pytest.mark.slow

CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\x1b\]8;[^\x1b]*\x1b\\|\r")
MISSION, BIG = example(sound=False), example(12, 40, sound=False)


def show(
    events: Sequence[ev.Event],
    width: int = 80,
    height: int = 24,
    terminal: bool = False,
    encoding: str = "utf-8",
    event_s: float = 0.02,
) -> str:
    """What stands on the console in the end; from one event to the next `event_s` pass on the wall."""
    ticks = itertools.count()
    file = io.TextIOWrapper(io.BytesIO(), encoding=encoding, newline="")
    console = Console(
        file=file, width=width, height=height, force_terminal=terminal, legacy_windows=False, _environ={"TERM": "xterm"}
    )
    started = next(e for e in events if isinstance(e, ev.Started))
    with LiveView(console, started, monotonic_s=lambda: event_s * next(ticks)) as view:
        for event in events:
            if event is not started:
                view.handle(event)
    file.flush()
    return file.buffer.getvalue().decode(encoding)  # type: ignore[attr-defined]


def test_a_pipe_gets_plain_lines_one_an_event() -> None:
    out = show(MISSION.events)
    assert "\x1b" not in out
    assert "\r" not in out
    lines = out.splitlines()
    said = [e for e in MISSION.events if isinstance(e, ev.Said)]
    for utterance in said:
        (line,) = [each for each in lines if f"{utterance.speaker}: {utterance.text}  [" in each]
        assert re.search(r"heard by|garbled at|not heard by", line)
    assert sum("has done task" in line for line in lines) == 5
    assert any("collided" in line for line in lines)
    assert "All 5 tasks done, each exactly once" in out
    assert "20 times faster than real time" in out


def test_who_heard_it_and_how_well() -> None:
    started = ev.Started(0.0, ("Rob", "Bot", "Ada"), (), (), "volunteer", 1, 40.0)
    said = ev.Said(1.0, 4.0, 0, "Rob", "Hi all, I am Rob", False)
    heard = ev.Heard(1.0, 0, "Bot", "Rob", said.text, 0.87, 20.0)
    out = show([started, said, heard, ev.Garbled(1.01, "Ada")])
    assert "0:04  Rob: Hi all, I am Rob  [heard by Bot 87 % · garbled at Ada]" in out
    out = show([started, ev.Garbled(1.01, "Ada"), heard, said])  # the listeners may be first
    assert "[heard by Bot 87 % · garbled at Ada]" in out
    wrong = ev.Heard(1.0, 0, "Bot", "Rob", "Hi all, I am Ada", 0.87, 20.0)
    out = show([started, said, wrong])
    assert "[Bot understood: Hi all, I am Ada · not heard by Ada]" in out
    out = show([started, ev.Heard(1.0, None, "Bot", "somebody", "stop", 0.9, 20.0), ev.Garbled(5.0, "Ada")])
    assert "no robot's (90 %): stop" in out
    assert "Ada heard speech, from no robot" in out


def test_of_many_listeners_the_least_sure_and_alone_nobody() -> None:
    robots = ("Rob", "Bot", "Ada", "Zoe", "Max", "Leo")
    started = ev.Started(0.0, robots, (), (), "volunteer", 1, 40.0)
    said = ev.Said(1.0, 4.0, 0, "Rob", "Hi all, I am Rob", False)

    def heard(confidence: float) -> list[ev.Event]:
        return [ev.Heard(1.0, 0, name, "Rob", said.text, confidence, 20.0) for name in robots[1:]]

    assert "[heard by 5 of 5, 100 %]" in show([started, said, *heard(0.998)])
    assert "[heard by 5 of 5, 87 % or more]" in show([started, said, *heard(0.87)])
    assert "[heard by 5 of 5]" in show([started, said, *heard(math.nan)]), "the word by itself"
    assert "[heard by 5 of 5, 87 % or more]" in show([started, said, *heard(0.87)[1:], *heard(math.nan)[:1]])
    two = replace(started, robots=("Rob", "Bot"))
    assert "[heard by Bot]" in show([two, said, *heard(math.nan)[:1]])
    assert "[nobody else is here]" in show([replace(started, robots=("Rob",)), said])


def test_lines_are_in_the_order_of_their_times_and_count_on() -> None:
    """Two speak at once, and tasks are done while somebody speaks and before it is known who heard it."""
    plants = tuple(ev.Plant(k, f"water the {color} rose", 1.0, 1.0) for k, color in ((1, "red"), (2, "blue")))
    started = ev.Started(0.0, ("Rob", "Bot"), (Pose(0, 0), Pose(1, 0)), plants, "volunteer", 1, 40.0)
    first, second = "Hi all, I am Rob, I will complete task one", "Hi all, I am Bot"
    out = show(
        [
            started,
            ev.Performed(5.0, "Bot", 2, 1.0, 1.0),
            ev.Said(2.0, 8.0, 0, "Rob", first, True),
            ev.Said(2.0, 5.5, 1, "Bot", second, True),  # it is issued after the longer one, which began first
            ev.Performed(9.0, "Rob", 1, 1.0, 1.0),
            ev.Moved(12.0, ()),
        ]
    )
    lines = [line for line in out.splitlines() if re.match(r" +\d:\d\d  ", line)]
    assert [line.split()[0] for line in lines] == ["0:05", "0:06", "0:08", "0:09"]
    assert [found[0] for line in lines if (found := re.search(r"\d of 2$", line))] == ["1 of 2", "2 of 2"]


@pytest.mark.parametrize("mission", [MISSION, BIG], ids=["small", "big"])
def test_in_no_mission_does_the_time_run_backward(mission: ev.MissionRecord) -> None:
    times = re.findall(r"^ +(\d+):(\d\d)  \S+: ", show(mission.events), re.M)
    assert len(times) > 10
    assert times == sorted(times, key=lambda found: (int(found[0]), int(found[1])))


def test_what_a_seal_is_worth_is_shown() -> None:
    started = ev.Started(0.0, ("Rob", "Bot"), (), (), "volunteer", 1, 40.0)
    said = ev.Said(1.0, 4.0, 0, "Rob", "Hi Bot, I am Rob, confirmed", False, "encrypted")
    heard = ev.Heard(1.0, 0, "Bot", "Rob", said.text, 0.87, 20.0, seal="encrypted")
    assert "encrypted ✓" in show([started, said, heard])
    forged = ev.Heard(1.0, 0, "Bot", "Rob", said.text, 0.87, 20.0, seal="not trusted")
    out = show([started, said, forged])
    assert "not trusted by Bot" in out
    assert "✓" not in out
    assert "✓" not in show([started, replace(said, seal=""), replace(heard, seal="")])


@pytest.mark.parametrize(("width", "height"), [(80, 24), (40, 12), (20, 5), (200, 60)])
@pytest.mark.parametrize("mission", [MISSION, BIG], ids=["small", "big"])
def test_no_line_is_wider_than_the_terminal(width: int, height: int, mission: ev.MissionRecord) -> None:
    out = show(mission.events, width, height, terminal=True, event_s=0.002)  # a picture for each line, and some between
    assert "\x1b[" in out
    lines = CONTROL.sub("\n", out).splitlines()
    assert max(map(cell_len, lines)) <= width
    assert lines[-1].startswith("  ") or width < 80


def test_a_terminal_keeps_the_conversation_and_the_end() -> None:
    out = CONTROL.sub("", show(MISSION.events, 100, 30, terminal=True))
    for event in MISSION.events:
        if isinstance(event, ev.Said):
            assert f"{event.speaker}: {event.text}" in out
    tail = out[-600:]
    assert "All 5 tasks done, each exactly once" in tail
    assert "Rob: water the green rose, water the indigo rose and water the yellow rose" in tail


def test_a_terminal_that_knows_only_ascii() -> None:
    out = show(MISSION.events, terminal=True, encoding="ascii")
    assert "All 5 tasks done" in out


def test_names_steer_nothing() -> None:
    tasks = tuple(f"[red]{HOSTILE}[/red] {k}" for k in range(3))
    record = example(names=("[bold]Rob[/bold]", "\x1b]0;x\x07Bot"), task_names=tasks, sound=False)
    plain = show(record.events)
    assert "[bold]Rob[/bold]:" in plain
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f\u202e]", plain)
    terminal = CONTROL.sub("", show(record.events, terminal=True))
    assert "\x1b" not in terminal
    assert "\x07" not in terminal


def test_the_board_tells_who_believes_otherwise() -> None:
    plant = ev.Plant(1, "water the red rose", 1.0, 1.0)
    started = ev.Started(0.0, ("Rob", "Bot"), (Pose(0, 0), Pose(1, 0)), (plant,), "volunteer", 1, 40.0)
    watch = Watch(started)
    assert [(r.state, r.owner, r.differing) for r in watch.board()] == [("open", None, ())]
    watch.handle(ev.TaskChanged(1.0, "Rob", 1, "claimed", "Rob"))
    (row,) = watch.board()
    assert (row.state, row.owner, row.differing) == ("claimed", "Rob", (("Bot", ("open", None)),))
    watch.handle(ev.TaskChanged(2.0, "Bot", 1, "claimed", "Rob"))
    assert watch.board()[0].differing == ()
    watch.handle(ev.Performed(9.0, "Rob", 1, 1.0, 1.0))
    (row,) = watch.board()
    assert (row.state, row.owner) == ("done", "Rob")
    assert {name for name, _ in row.differing} == {"Rob", "Bot"}
    watch = Watch(started)
    watch.handle(ev.TaskChanged(1.0, "Rob", 1, "claimed", "Rob"))
    (note,) = watch.handle(ev.TaskChanged(2.0, "Rob", 1, "open", None))
    assert type(note).__name__ == "GaveUp"


def test_a_sentence_that_a_later_search_understands_is_not_told_as_garbled() -> None:
    watch = Watch(ev.Started(0.0, ("Rob", "Bot"), (Pose(0, 0), Pose(1, 0)), (), "volunteer", 1, 40.0))
    text = "Hi all, I am Rob"
    events = [
        ev.Said(0.1, 2.0, 0, "Rob", text, False),
        ev.Garbled(2.1, "Bot"),
        ev.Heard(2.3, 0, "Bot", "Rob", text, 1.0, 20.0),
        ev.Moved(2.5 + PATIENCE_S, (Pose(0, 0), Pose(1, 0))),
    ]
    (line,) = [note for event in events for note in watch.handle(event)]
    assert isinstance(line, Line)
    assert ([heard.listener for heard in line.heard], line.garbled) == (["Bot"], ())


names = st.sampled_from(["Rob", "Bot", "Ada", "[x]", "\x1b[2J", ""])
times = st.floats(-1.0, 4000.0)
places = st.floats(-1e4, 1e4)
numbers = st.integers(-1, 5)
poses = st.builds(Pose, places, places, places)
plants = st.builds(ev.Plant, numbers, st.text(max_size=12), places, places)
shares = st.floats(allow_nan=True)
words = st.lists(st.tuples(st.text(max_size=4), times, times), max_size=2).map(tuple)
any_event = st.one_of(
    st.builds(ev.Said, times, times, numbers, names, st.text(max_size=20), st.booleans()),
    st.builds(ev.Heard, times, st.none() | numbers, names, names, st.text(max_size=20), shares, shares, words),
    st.builds(ev.Garbled, times, names),
    st.builds(ev.TaskChanged, times, names, numbers, st.sampled_from(["open", "claimed", "done"]), names),
    st.builds(ev.Performed, times, names, numbers, places, places),
    st.builds(ev.Moved, times, st.lists(poses, max_size=3).map(tuple)),
)
any_start = st.builds(
    ev.Started,
    st.just(0.0),
    st.lists(names, max_size=3, unique=True).map(tuple),
    st.lists(poses, max_size=3).map(tuple),
    st.lists(plants, max_size=3, unique_by=lambda p: p.task).map(tuple),
    st.sampled_from(["volunteer", "coordinate", "?"]),
    st.integers(0, 99),
    shares,
)
MAYBE_SUMMARY = st.lists(st.just(MISSION.events[-1]), max_size=1)


@given(any_start, st.lists(any_event, max_size=12), MAYBE_SUMMARY, st.booleans())
@settings(max_examples=60, deadline=None)
def test_no_stream_of_events_breaks_the_view(
    start: ev.Started, some: list[ev.Event], last: list[ev.Event], terminal: bool
) -> None:
    out = show([start, *some, *last], terminal=terminal)
    if not terminal:
        assert "\x1b" not in out
        listened = sum(line.endswith("]") and "  [" in line for line in out.split("\n"))
        assert listened >= sum(isinstance(e, ev.Said) for e in some)


@given(any_start, st.lists(any_event, max_size=12), MAYBE_SUMMARY)
@settings(max_examples=60, deadline=None)
def test_no_stream_of_events_breaks_the_page(start: ev.Started, some: list[ev.Event], last: list[ev.Event]) -> None:
    parsed = Page(page(ev.MissionRecord((start, *some, *last), (), MISSION.sound)))
    assert len(parsed.of_class("said")) == sum(isinstance(e, ev.Said) for e in some)


def test_who_did_a_task_again_is_listed_with_it() -> None:
    doings = [e for e in MISSION.events if isinstance(e, ev.Performed)]
    by_bot = [replace(d, robot="Rob1") for d in doings]
    again = [*(replace(d, robot="Rob") for d in doings), *by_bot, by_bot[0]]
    events = [e for e in MISSION.events if not isinstance(e, ev.Performed | ev.Summary)]
    last = next(e for e in MISSION.events if isinstance(e, ev.Summary))
    out = show([*events, *again, replace(last, duplicates=len(doings) + 1, repeated=tuple(d.task for d in doings))])
    end = " ".join(out.partition("Not everything went well")[2].split())
    rob, bot = end.partition("Rob: ")[2].partition("Rob1: ")[::2]
    names = {plant.task: plant.name for e in events if isinstance(e, ev.Started) for plant in e.plants}
    assert f"{len(doings)} done more than once" in end
    assert all(names[d.task] in line for d in doings for line in (rob, bot))
    assert "(2 times)" in bot
    assert "times)" not in rob


def test_what_was_not_done_is_named_with_the_reason_that_a_skill_gave() -> None:
    lost = next(e for e in MISSION.events if isinstance(e, ev.Performed))
    last = next(e for e in MISSION.events if isinstance(e, ev.Summary))
    failed = ev.Skill(lost.at_s, lost.robot, 1, lost.task, "pour", "failed", text="the tank is empty")
    rest = [e for e in MISSION.events if e != last and not (isinstance(e, ev.Performed) and e.task == lost.task)]
    names = {plant.task: plant.name for e in MISSION.events if isinstance(e, ev.Started) for plant in e.plants}
    end = show([*rest, failed, replace(last, lost=1, undone=(lost.task,))]).partition("Not everything went well")[2]
    assert f"not done: task {lost.task}, {names[lost.task]} (the tank is empty)" in end
    assert end.count("not done: ") == 1
    on_demand = show([*rest, failed, last])
    assert "not done: " not in on_demand, "what nobody asked for is not missed"


def test_what_several_robots_do_together_is_done_with_the_last_part() -> None:
    """The first part counted as the whole, and two parts as a task that was done twice."""
    first, second = (e for e in MISSION.events if isinstance(e, ev.Performed) and e.task in (1, 2))
    last = next(e for e in MISSION.events if isinstance(e, ev.Summary))
    started = next(e for e in MISSION.events if isinstance(e, ev.Started))
    both = [replace(first, robot=name) for name in started.robots[:2]]
    head = replace(started, shared=((first.task, 2),))
    failed = ev.Skill(second.at_s, second.robot, 1, first.task, "pour", "failed", text="the tank is empty")

    whole = show([head, *both, replace(last, lost=1, undone=(second.task,))])
    assert f"{both[0].robot} has done its part of task {first.task}" in whole
    assert f"{both[1].robot} has done task {first.task}" in whole
    assert "more than once" not in whole
    half = show([head, both[0], failed, replace(last, lost=1, undone=(first.task,))])
    name = {plant.task: plant.name for plant in started.plants}[first.task]
    assert f"half done: task {first.task}, {name} (the tank is empty)" in half
    events = (head, *both, replace(last, lost=1, undone=(second.task,)))
    rows = Page(page(ev.MissionRecord(events, (), MISSION.sound)))
    assert len(rows.of_class("bad")) == 2, "the verdict, and the one task that was not done"
    assert "2 times" not in "".join(rows.text)


def test_what_nobody_asked_for_is_not_counted() -> None:
    """The last task was "2 of 3", and then all 2 were done."""
    acts = [e for e in MISSION.events if isinstance(e, ev.Performed)]
    started = next(e for e in MISSION.events if isinstance(e, ev.Started))
    out = show([replace(started, on_demand=(acts[0].task,)), *acts[1:]])
    assert f": {len(acts) - 1} of {len(acts) - 1}" in out
