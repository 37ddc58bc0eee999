"""The control socket of a daemon: what it tells and does, and what bad clients cannot do."""

from __future__ import annotations

import asyncio
import io
import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st
from rich.console import Console
from structlog.testing import capture_logs

from hvcpd import __version__
from hvcpd.control.live.status_screen import status_screen
from hvcpd.coordination.peers import Away
from hvcpd.coordination.saying import MAX_SENTENCES
from hvcpd.coordination.states import State
from hvcpd.daemon.control_lobby import MAX_WAITING
from hvcpd.daemon.control_protocol import MAX_LINE_BYTES
from hvcpd.daemon.control_server import MAX_CLIENTS, MAX_FOLLOWERS, MAX_UNREAD_BYTES
from hvcpd.daemon.reloading import Reloader
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import NotDoneError, RunningError
from hvcpd.memory.latch import Permit, StopLatch
from hvcpd.memory.people import person_path, remove_person, write_person
from hvcpd.people.enrolled import Person
from hvcpd.ports import STANDSTILL, WheelCommand
from hvcpd.recognition.events import Garbled, Recognised
from hvcpd.reporting.text import shown_away
from tests.daemon.control_bench import ONE_TASK, ControlBench, Talk, control, run

ORDER = tuple("hi rob i am bot water the green rose".split())


def heard(words: tuple[str, ...] = ORDER) -> Recognised:
    return Recognised(words, "oak", 0, 8000, 0.95, 20.0, ())


def shown(status: dict[str, Any]) -> str:
    """As `hvcpctl status` shows it."""
    console = Console(width=120, file=io.StringIO())
    console.print(status_screen(status))
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


def test_status_tells_who_it_is_and_what_it_does(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            await bench.live(heard(), blocks=12)
            talk = await bench.connect()
            reply = await talk.say(b'{"id": 7, "command": "status"}\n')
            assert reply["id"] == 7
            status = reply["result"]
            assert (status["name"], status["team"], status["version"]) == ("Rob", "plant", __version__)
            assert status["pid"] == os.getpid()
            assert status["tasks"] == {"open": 1}
            assert status["peers"][0] | {"heard_ago_s": 0} == {
                "name": "Bot",
                "team": None,
                "present": True,
                "heard_ago_s": 0,
                "confidence": 0.95,
                "snr_db": 20.0,
                "away": None,
            }
            robot = bench.bench.robot
            robot.coordination.ranged("Bot", Away(2.31416, 0.0243, False, robot.now - 3.0))
            again = (await talk.say(b'{"command": "status"}\n'))["result"]["peers"][0]
            assert again["away"] == {"distance_m": 2.314, "deviation_m": 0.024, "sure": False, "ago_s": 3.0}
            assert shown_away(again) == "2.31 ± 0.02 m, unsure"
            assert status["sound"]["level_dbfs"] == -20.0
            assert status["battery_v"] == 11.9
            assert bench.bench.robot.coordination.knowledge.body.battery_v == 11.9, "what a report says"
            assert status["wheels"]["fault"] is None
            board = (await talk.ask("tasks"))["result"]["tasks"]
            assert [(task["number"], task["name"], task["state"]) for task in board] == [
                (1, "water the green rose", "open")
            ]
            await talk.hang_up()

    run(scene())


def test_stop_halts_the_wheels_before_the_next_block_and_is_said_aloud(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            wheels = bench.body.wheels
            assert wheels is not None
            wheels.serve(WheelCommand(3.0, 3.0), 0.0)
            await wheels.settled()
            assert bench.wheels.told[-1] == WheelCommand(3.0, 3.0)
            talk = await bench.connect()
            stopped = (await talk.ask("stop"))["result"]
            assert stopped == {"stopped": True, "before": False, "kept": True, "reason": None}
            await wheels.settled()
            assert bench.wheels.told[-1] == STANDSTILL
            assert bench.bench.robot.coordination.state is State.STOPPED
            await talk.ask("subscribe", events=["said"])
            await bench.live(blocks=120)  # not before a spoken "stop" would have gone on from robot to robot
            said = await talk.line()
            assert said is not None
            assert said["text"] == "Hi all, I am Rob, I have stopped"
            assert (await talk.ask("stop"))["result"]["before"] is True
            assert starts_stopped(bench)
            told = {"stopped": False, "kept": True, "reason": None}
            assert (await talk.ask("resume"))["result"] == told | {"before": True}
            assert not starts_stopped(bench), "it is kept when it is answered"
            assert (await talk.ask("resume"))["result"] == told | {"before": False}
            await talk.hang_up()

    run(scene())


def starts_stopped(bench: ControlBench) -> bool:
    """Whether the latch, as it is on the disk, would have the next start stopped."""
    latched = StopLatch(bench.body.wiring.latch_path).read()
    return latched is None or latched.permit is not Permit.FREE


def test_a_task_is_left_out_and_wanted_again_and_the_others_are_told(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            for do, refusal in (("skip", "task 1 is done already"), ("again", "task 1 is still to be done")):
                reply = await talk.ask("task", do=do, number=1)
                assert reply["result"] == {"number": 1, "name": "water the green rose", "do": do}
                assert (await talk.ask("task", do=do, number=1))["error"] == {"code": "refused", "text": refusal}
            assert "there is no task 0" in (await talk.ask("task", do="skip"))["error"]["text"]
            assert (await talk.ask("task", do="paint", number=1))["error"]["code"] == "bad_argument"
            await talk.ask("subscribe", events=["said"])
            await bench.live(blocks=300)
            said = [await talk.line(), await talk.line()]
            assert "Hi all, I am Rob, task one again, change two" in [line["text"] for line in said if line]
            await talk.hang_up()

    run(scene())


def test_a_stop_before_the_robot_is_there_is_not_forgotten(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path, with_robot=False) as bench:
            talk = await bench.connect()
            bench.body.preparation.text = "preparing words: Bot's words, 3 of 97"
            status = (await talk.ask("status"))["result"]
            assert status["state"] == "starting"
            assert "Bot's words, 3 of 97" in shown(status)
            assert "not opened yet" in shown(status), "it has wheels"
            assert (await talk.ask("tasks"))["error"]["code"] == "starting"
            assert (await talk.ask("reload"))["error"]["code"] == "starting", "the plan is made of what was read before"
            assert (await talk.ask("stop"))["ok"]
            bench.begin()
            assert (await talk.ask("status"))["result"]["stopped"] is True
            await talk.hang_up()

    run(scene())


def test_sentences_are_said_in_turn_and_only_those_that_are_true(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            await talk.ask("subscribe", events=["said"])
            asked = await talk.ask("say", text="hi bot, i am rob, what are you doing")
            assert asked["result"] == {"text": "Hi Bot, I am Rob, what are you doing"}
            await bench.live(blocks=200)
            said = await talk.line()
            assert said is not None
            assert said["text"] == "Hi Bot, I am Rob, what are you doing"
            asked = await talk.ask("say", text="hi bot")
            assert asked["result"] == {"text": "Bot, who is here"}
            for text, code in (
                ("hi rob, i am bot, water the green rose", "refused"),
                ("hi all, i am rob, task one complete", "refused"),
                ("hi all, i am rob, i have stopped", "refused"),
                ("open the pod bay doors", "not_in_phrasebook"),
                ("", "bad_argument"),
                ("x" * 300, "bad_argument"),
            ):
                assert (await talk.ask("say", text=text))["error"]["code"] == code
            for _ in range(MAX_SENTENCES - 1):
                assert (await talk.ask("say", text="hi bot, i am rob, what is left"))["ok"]
            assert "wait to be said" in (await talk.ask("say", text="stop"))["error"]["text"]
            await talk.hang_up()

    run(scene())


def test_events_come_to_who_wants_them_and_readings_only_by_name(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            everything, levels, nothing = [await bench.connect() for _ in range(3)]
            assert "level" not in (await everything.ask("subscribe"))["result"]["events"]
            await levels.ask("subscribe", events=["level"])
            await bench.live(heard(), Garbled(8000, 9000), blocks=12)
            kinds = [(await everything.line() or {})["event"] for _ in range(3)]
            assert kinds[:2] == ["heard", "garbled"]
            assert kinds[2] == "statechanged"
            level = await levels.line()
            assert level is not None
            assert (level["event"], level["level_dbfs"]) == ("level", pytest.approx(-20.0, abs=1e-4))
            bad = await nothing.ask("subscribe", events=["herd"])
            assert "did you mean 'heard'" in bad["error"]["text"]
            assert (await nothing.ask("subscribe", events=[[]]))["error"]["code"] == "bad_argument"
            assert (await nothing.ask("status"))["ok"], "nothing else came before it"
            for talk in (everything, levels, nothing):
                await talk.hang_up()

    run(scene())


def test_the_transcript_comes_in_pages(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            for _ in range(5):
                await bench.live(heard(), blocks=2)
            talk = await bench.connect()
            first = (await talk.ask("transcript", limit=2))["result"]["rows"]
            rest = (await talk.ask("transcript", after=first[-1]["number"]))["result"]["rows"]
            assert [row["number"] for row in first + rest] == [1, 2, 3, 4, 5]
            assert first[0]["text"] == "Hi Rob, I am Bot, water the green rose"
            assert (await talk.ask("transcript", since_s=2.0**52))["result"]["rows"] == []
            assert (await talk.ask("transcript", limit=0))["error"]["code"] == "bad_argument"
            assert (await talk.ask("transcript", after=-1))["error"]["code"] == "bad_argument"
            await talk.hang_up()

    run(scene())


def test_settings_come_with_their_sources(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            settings = {each["key"]: each for each in (await talk.ask("config"))["result"]["settings"]}
            assert settings["name"] == {"key": "name", "value": "Rob", "source": "--name"}
            assert settings["pick"]["source"] == "default"
            await talk.hang_up()

    run(scene())


def test_reload_changes_how_much_the_robot_says(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            usual = {"now": "normal", "level_db": 0.0, "quiet": None}
            assert (await talk.ask("status"))["result"]["talk"] == usual
            bench.file.write_text('talk: full\nquiet: {hours: "00:00-23:59", level_db: -6}\n')
            changed = [change["key"] for change in (await talk.ask("reload"))["result"]["changed"]]
            assert changed == ["talk", "quiet.hours", "quiet.level_db"]
            settings, role = bench.body.wiring.settings, bench.bench.robot.coordination.role
            noon_s = datetime(2026, 11, 23, 12).timestamp()
            quiet = bench.body.wiring.with_talk(role, noon_s)
            assert (quiet.talk.value, quiet.softly_db) == ("terse", -6.0)
            by_day = bench.body.wiring.with_talk(quiet, noon_s + 11 * 3600.0 + 59 * 60.0)
            assert (by_day.talk.value, by_day.softly_db) == ("full", 0.0)
            no_clock = replace(bench.body.wiring, settings=replace(settings, clock=False))
            assert no_clock.with_talk(by_day, noon_s) is by_day, "it has no quiet hours"
            status = (await talk.ask("status"))["result"]
            assert status["talk"]["quiet"] == "00:00-23:59"
            assert "(quiet hours 00:00-23:59)" in shown(status)
            await talk.hang_up()

    run(scene())


def test_reload_changes_what_it_can_and_names_what_it_cannot(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": []}
            bench.file.write_text("mode: follow\nunable: [1]\naudio: {block_ms: 20}\n")
            tasks = tmp_path / "tasks.yaml"
            tasks.write_text(ONE_TASK.replace("x_m: 0", "x_m: 2"))
            result = (await talk.ask("reload"))["result"]
            assert result["restart"] == ["audio.block_ms"]
            assert [change["key"] for change in result["changed"]] == ["mode", "unable", "task 1"]
            role = bench.bench.robot.coordination.role
            assert (role.volunteer, role.unable) == (False, frozenset({1}))
            assert (await talk.ask("status"))["result"]["mode"] == "follow"
            (task,) = (await talk.ask("tasks"))["result"]["tasks"]
            assert (task["place"], task["unable"]) == ({"x_m": 2.0, "y_m": 0.0}, True)
            settings = {each["key"]: each for each in (await talk.ask("config"))["result"]["settings"]}
            assert settings["mode"]["source"] == f"{bench.file}:1"
            assert settings["audio.block_ms"]["value"] == 25, "what is in force"
            tasks.write_text(ONE_TASK.replace("green", "pink"))
            assert (await talk.ask("reload"))["result"]["restart"] == ["audio.block_ms", "tasks"]
            bench.file.write_text("mood: follow\nmode: volunteer\n")
            refused = (await talk.ask("reload"))["error"]
            assert refused["code"] == "bad_settings"
            assert "did you mean 'mode'" in refused["text"]
            assert bench.bench.robot.coordination.role.volunteer is False, "all or nothing"
            await talk.hang_up()

    run(scene())


def test_reload_takes_tasks_with_new_words_once_the_robot_knows_these(tmp_path: Path) -> None:
    two = ONE_TASK + ONE_TASK.partition("tasks:\n")[2].replace("number: 1", "number: 2").replace("green", "pink")

    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            learned: list[Callable[[], None]] = []
            bench.body.retask = lambda _tasks, then: learned.append(then)
            (tmp_path / "tasks.yaml").write_text(two)
            result = (await talk.ask("reload"))["result"]
            new = {"key": "task 2", "before": None, "now": "water the pink rose"}
            assert result == {"changed": [new], "restart": []}
            assert len((await talk.ask("tasks"))["result"]["tasks"]) == 1, "it does not know the words yet"
            learned.pop()()
            board = (await talk.ask("tasks"))["result"]["tasks"]
            assert [task["name"] for task in board] == ["water the green rose", "water the pink rose"]
            await bench.live(blocks=2)
            await bench.journal.settled()
            (tmp_path / "tasks.yaml").write_text(two.replace("pink", "white"))
            (change,) = (await talk.ask("reload"))["result"]["changed"]
            assert change == {"key": "task 2", "before": "water the pink rose", "now": "water the white rose"}
            (tmp_path / "tasks.yaml").write_text(ONE_TASK)
            (change,) = (await talk.ask("reload"))["result"]["changed"]
            assert change == {"key": "task 2", "before": "water the white rose", "now": None}, (
                "though it is not known yet"
            )
            for then in learned:
                then()
            assert [task["number"] for task in (await talk.ask("tasks"))["result"]["tasks"]] == [1]
            (tmp_path / "tasks.yaml").write_text(two.replace("pink", "grin"))
            assert "sounds like" in (await talk.ask("reload"))["error"]["text"]
            await talk.hang_up()

    run(scene())


def test_a_task_is_added_and_removed_and_the_task_file_stays_as_it_is(tmp_path: Path) -> None:
    tulip = {"number": 11, "name": "water the red tulip", "place": {"x_m": 1.2, "y_m": 0.5}}
    tulip |= {"actions": ["go to place", {"water": 5}], "after": [1], "every": "6 h"}

    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            bench.body.retask = lambda _tasks, then: then()
            kept = bench.body.wiring.settings.task_changes_path
            for wrong, why in (
                (tulip | {"number": 1}, "there already is a task 1"),
                (tulip | {"name": "water the grin rose"}, "sounds like 'water the green rose' in line 2"),
                (tulip | {"after": [11]}, "task 11: task 11 after task 11"),
                (tulip | {"actions": [{"wave": 3}]}, "unknown action 'wave'"),
                (tulip | {"colour": "red"}, "unknown key 'colour'"),
                (tulip | {"name": "\ud800"}, "UTF-8"),
            ):
                error = (await talk.ask("task", do="add", task=wrong))["error"]
                assert (error["code"], why in error["text"]) == ("bad_settings", True), error
            assert not kept.exists(), "what is refused is not kept"
            result = (await talk.ask("task", do="add", task=tulip))["result"]
            assert result["changed"] == [{"key": "task 11", "before": None, "now": "water the red tulip"}]
            board = (await talk.ask("tasks"))["result"]["tasks"]
            assert [(task["number"], task["every"]) for task in board] == [(1, None), (11, "6 h")]
            assert wire_up(bench.body.wiring.settings).tasks == bench.body.wiring.tasks, "as after a restart"
            error = (await talk.ask("task", do="remove", number=1))["error"]
            assert "comes after task 1, which does not exist" in error["text"]
            assert (await talk.ask("task", do="remove", number=11))["result"]["changed"][0]["now"] is None
            assert "there is no task 11" in (await talk.ask("task", do="remove", number=11))["error"]["text"]
            assert (await talk.ask("task", do="add", task=tulip | {"after": []}))["result"]["restart"] == []
            assert (await talk.ask("task", do="remove", number=1))["result"]["changed"][0]["key"] == "task 1"
            assert [task["number"] for task in (await talk.ask("tasks"))["result"]["tasks"]] == [11]
            assert (tmp_path / "tasks.yaml").read_text() == ONE_TASK
            await talk.hang_up()

    run(scene())


def test_who_has_no_settings_to_read_again_says_so(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            with pytest.raises(NotDoneError, match="no settings to read"):
                await Reloader(bench.body, None).remove(1)

    run(scene())


@pytest.mark.slow
def test_a_word_that_would_be_taken_for_another_is_refused_with_a_proposal(tmp_path: Path) -> None:
    async def scene() -> None:
        board = ONE_TASK.replace("green", "lamp")
        async with control(tmp_path, board=board, compares_words=True) as bench:
            talk = await bench.connect()
            land = {"number": 2, "name": "water the land rose", "actions": ["dock"]}
            error = (await talk.ask("task", do="add", task=land))["error"]
            assert error["code"] == "bad_settings"
            assert "instead of 'lamp' say for example 'lantern'" in error["text"]
            assert not bench.body.wiring.settings.task_changes_path.exists()
            await talk.hang_up()

    asyncio.run(scene())  # a comparison in which much is wrong takes its time


def test_reload_takes_new_words_and_whoever_is_new_or_gone(tmp_path: Path) -> None:
    take = np.ones((20, 24), np.float32)
    anna = Person("Anna", {"stop": [take]})
    state = tmp_path / "state"
    write_person(person_path(state, "Anna"), anna)

    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            write_person(person_path(state, "Anna"), anna.with_takes({"rob": [take]}))
            joined: list[Sequence[str]] = []
            bench.body.join = joined.append
            (more,) = (await talk.ask("reload"))["result"]["changed"]
            assert more == {"key": "takes of Anna", "before": 1, "now": 2}
            kept = bench.body.wiring.people["anna"]
            assert kept.words == {"stop", "rob"}
            assert joined == [[]], "what the net makes of the new word is found out before it is needed"
            assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": []}
            assert bench.body.wiring.people["anna"] is kept
            assert joined == [[]]
            write_person(person_path(state, "Ben"), Person("Ben", {"stop": [take]}))
            result = (await talk.ask("reload"))["result"]
            change = {"key": "people", "before": ["Anna"], "now": ["Anna", "Ben"]}
            assert result == {"changed": [change], "restart": []}
            assert joined == [[], ["Ben"]]
            remove_person(person_path(state, "Anna"))
            (change,) = (await talk.ask("reload"))["result"]["changed"]
            assert change["now"] == ["Ben"]
            assert list(bench.body.wiring.people) == ["ben"], "whom the second look listens for"
            assert joined == [[], ["Ben"], []]
            await talk.hang_up()

    run(scene())


def test_who_counts_stays_the_same_while_the_settings_for_it_wait_for_a_restart(tmp_path: Path) -> None:
    anna = Person("Anna", {"stop": [np.ones((20, 24), np.float32)]})
    write_person(person_path(tmp_path / "state", "Anna"), anna)

    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            bench.file.write_text("mode: volunteer\nvoices: robots\n")
            assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": ["voices"]}
            assert list(bench.body.wiring.people) == ["anna"]
            bench.file.write_text("mode: volunteer\n")
            assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": []}
            await talk.hang_up()

    run(scene())


def test_whom_the_settings_name_is_a_robot_until_a_restart(tmp_path: Path) -> None:
    anna = Person("Anna", {"stop": [np.ones((20, 24), np.float32)]})

    async def scene() -> None:
        async with control(tmp_path, names=["Rob", "Anna"]) as bench:
            talk = await bench.connect()
            write_person(person_path(tmp_path / "state", "Anna"), anna)
            result = (await talk.ask("reload"))["result"]
            assert result["restart"] == ["people"]
            assert [change["now"] for change in result["changed"]] == [["Anna"]]
            await talk.hang_up()

    run(scene())


async def lives_on(bench: ControlBench, other: Talk) -> None:
    """The robot takes its blocks, and another client is served."""
    await bench.live(blocks=2)
    assert (await other.ask("status"))["ok"]


def test_who_does_not_read_is_let_go_and_holds_nobody_up(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            deaf, other = await bench.connect(), await bench.connect()
            await deaf.ask("subscribe", events=["heard"])
            deaf.writer.transport.pause_reading()  # type: ignore[attr-defined]
            words = [(word, 0.0, 1.0) for word in ORDER]
            one = len(json.dumps({"event": "heard", "words": words}))
            with capture_logs() as logs:
                for _ in range(4 * MAX_UNREAD_BYTES // one):
                    bench.service.publish({"event": "heard", "words": words})
                await lives_on(bench, other)
            assert [line["reason"] for line in logs if line["event"] == "control client disconnected"] == [
                "it does not read"
            ]
            deaf.writer.transport.abort()
            await other.hang_up()

    run(scene())


def test_a_line_too_long_and_a_line_cut_short_end_only_their_client(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            other = await bench.connect()
            long = await bench.connect()
            assert (await long.say(b"x" * (3 * MAX_LINE_BYTES)))["error"]["code"] == "too_long"
            assert await long.line() is None
            cut = await bench.connect()
            cut.writer.write(b'{"command": "st')
            await cut.hang_up()
            longest = b'{"command":"status"' + b" " * (MAX_LINE_BYTES - 21) + b"}\n"
            assert (await other.say(longest))["ok"]
            await lives_on(bench, other)
            await long.hang_up()
            await other.hang_up()

    run(scene())


def test_places_are_kept_for_who_has_something_to_ask(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talks = [await bench.connect() for _ in range(MAX_CLIENTS)]
            for number, talk in enumerate(talks[: MAX_FOLLOWERS + 1]):
                reply = await talk.ask("subscribe", events=["heard"])
                assert reply["ok"] == (number < MAX_FOLLOWERS)
            hanging = talks[MAX_FOLLOWERS]
            for talk in talks[MAX_FOLLOWERS + 1 :]:
                await talk.ask("status")
            late = await bench.connect()
            assert (await late.ask("stop"))["ok"], "there is always room for who wants to stop the robot"
            gone = await hanging.line()
            assert gone is not None
            assert gone["error"]["code"] == "busy"
            assert await hanging.line() is None
            await lives_on(bench, talks[0])
            for talk in (*talks, late):
                await talk.hang_up()

    run(scene())


def test_a_second_daemon_of_the_name_does_not_start(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            second = ControlBench(tmp_path)
            with pytest.raises(RunningError, match="already runs on this computer"):
                await second.service.open()
            await second.service.close()
            second.service.release()
            talk = await bench.connect()
            await lives_on(bench, talk)
            await talk.hang_up()

    run(scene())


def test_without_a_place_for_the_socket_the_robot_lives_on(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")

    async def scene() -> None:
        with capture_logs() as logs:
            async with control(tmp_path, **{"control.socket": str(tmp_path / "file" / "rob.sock")}) as bench:
                await bench.live(blocks=2)
        (warning,) = [line for line in logs if line["event"] == "no control socket"]
        assert "control.socket" in warning["remedy"]
        async with control(tmp_path, **{"control.enabled": False}) as bench:
            assert not bench.path.exists()
            await bench.live(blocks=2)

    run(scene())


def test_a_memory_that_fails_is_told_as_an_event_and_in_the_status(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            await talk.ask("subscribe", events=["memory"])
            assert (await talk.ask("status"))["result"]["memory"]["fault"] is None
            bench.body.wiring.settings.memory_path.unlink()
            with capture_logs():
                await bench.live(heard(), blocks=2)
                await bench.journal.settled()
                await bench.live(blocks=1)
            event = await talk.line()
            assert event is not None
            assert (event["event"], event["unkept"], event["loss"]) == ("memory", None, None)
            assert "is gone" in event["fault"]
            assert (await talk.ask("status"))["result"]["memory"]["fault"] == event["fault"]
            assert (await talk.ask("stop"))["result"]["kept"] is True, "the latch is another file"
            await talk.hang_up()

    run(scene())


def test_who_says_nothing_takes_nobodys_place(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            asking = await bench.connect()
            await asking.ask("status")
            silent = [await bench.connect() for _ in range(MAX_WAITING + 3)]
            assert [await talk.line() for talk in silent[:3]] == [
                {
                    "id": None,
                    "ok": False,
                    "error": {"code": "busy", "text": f"{MAX_WAITING} programs wait to be served"},
                }
            ] * 3
            assert await silent[0].line() is None
            assert (await silent[3].ask("status"))["ok"]
            assert (await asking.ask("stop"))["ok"]
            for talk in (asking, *silent):
                await talk.hang_up()

    run(scene())


def test_who_asked_for_what_is_in_the_log(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            with capture_logs() as logs:
                await talk.ask("stop")
                await talk.ask("status")
            (line,) = [line for line in logs if line["event"] == "asked to"]
            assert (line["command"], line["uid"], line["pid"]) == ("stop", os.getuid(), os.getpid())
            await talk.hang_up()

    run(scene())


CHUNKS = st.one_of(
    st.binary(max_size=80),
    st.sampled_from([b"\n", b"\0", b"[" * 5000, b'{"command":', b'"status"}\n', b'{"command":"stop"}\n', b"x" * 9000]),
    st.builds(
        lambda command, arguments: json.dumps({"command": command, **arguments}).encode() + b"\n",
        st.sampled_from(["status", "tasks", "say", "stop", "resume", "transcript", "config", "subscribe", "reload"]),
        st.dictionaries(
            st.sampled_from(["id", "text", "after", "since_s", "limit", "events"]),
            st.none() | st.integers() | st.floats() | st.text(max_size=9) | st.lists(st.text(max_size=9), max_size=3),
            max_size=3,
        ),
    ),
)


Lasting = tuple[asyncio.Runner, ControlBench]


@pytest.fixture(scope="module")
def lasting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lasting]:
    """One bench for all examples: making one takes longer than many of them."""
    with asyncio.Runner() as runner:
        bench = ControlBench(tmp_path_factory.mktemp("lasting"))
        runner.run(bench.open())
        yield runner, bench
        runner.run(bench.close())


@given(chunks=st.lists(CHUNKS, max_size=6), reads=st.booleans())
@examples(max_examples=60)
def test_whatever_a_client_sends_the_robot_lives_and_others_are_served(
    lasting: Lasting, chunks: list[bytes], reads: bool
) -> None:
    runner, bench = lasting

    async def scene() -> None:
        fuzzer, other = await bench.connect(), await bench.connect()
        for chunk in chunks:
            fuzzer.writer.write(chunk)
            await asyncio.sleep(0)
        if reads:
            fuzzer.writer.write_eof()
            while (line := await fuzzer.line()) is not None:
                assert "ok" in line or "event" in line
        await fuzzer.hang_up()
        await lives_on(bench, other)
        await other.hang_up()

    with capture_logs() as logs:
        runner.run(asyncio.wait_for(scene(), 30.0))
    assert not [line for line in logs if line["log_level"] == "error"]
