"""The control service of a daemon: what it tells and does."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from structlog.testing import capture_logs

from hvcpd import __version__
from hvcpd.config.shared_places import SharedPlace
from hvcpd.control.live.status_screen import memory_faults, status_screen
from hvcpd.coordination.place_state import WAITS_S, PlaceState
from hvcpd.coordination.saying import MAX_SENTENCES
from hvcpd.daemon.sound_service import SoundService
from hvcpd.recognition.events import Garbled, Recognised
from hvcpd.reporting.metrics import metrics_of
from hvcpd.reporting.text import shown_away
from hvcpd.robot.records import RangeRecord
from tests.daemon.control_bench import control, talking
from tests.daemon.test_sound_service import Clock, Streams

ORDER = tuple("hi rob i am bot water the green rose".split())


def heard(words: tuple[str, ...] = ORDER) -> Recognised:
    return Recognised(words, "oak", 0, 8000, 0.95, 20.0, ())


def shown(status: dict[str, Any], width: int = 120) -> str:
    """As `hvcpctl status` shows it."""
    console = Console(width=width, file=io.StringIO())
    console.print(status_screen(status))
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


async def test_losses_of_sound_are_told_from_the_first_none_on(tmp_path: Path) -> None:
    """A counter that appears only with the first loss hides that loss from whoever compares two readings."""
    async with control(tmp_path) as bench:
        await bench.live(heard(), blocks=12)
        streams = Streams(Clock(), 1)
        bench.body.sound = SoundService(streams.make, streams.clock, streams.clock.sleep)
        status = (await (await bench.connect()).ask("status"))["result"]
        assert status["sound"]["lost"]["card_underflows"] == 0
        assert 'hvcpd_sound_lost_total{robot="Rob",kind="card_underflows"} 0' in metrics_of(status).splitlines()
        assert "underflows" not in shown(status)


async def test_who_has_left_a_place_or_ceased_to_ask_for_it_is_not_shown_to_have_it_or_wait(tmp_path: Path) -> None:
    async with control(tmp_path) as bench:
        await bench.live(blocks=12)
        robot = bench.bench.robot
        corridor = PlaceState(SharedPlace("corridor", 0.0, 0.0, 1.0, 1.0), robot.now)
        robot.coordination.knowledge.places = (corridor,)
        corridor.note_waiting("Max", robot.now - WAITS_S - 1.0)
        corridor.note_waiting("Bot", robot.now - 1.0)
        status = (await (await bench.connect()).ask("status"))["result"]
        assert status["places"][0]["waiting"] == ["Bot"]
        area = {"low_x_m": 0.0, "low_y_m": 0.0, "high_x_m": 1.0, "high_y_m": 1.0, "radius_m": 0.0}
        assert status["places"][0]["area"] == area
        assert "corridor: nobody has it; waiting: Bot " in shown(status)
        corridor.keep("Max", robot.now)
        status = (await (await bench.connect()).ask("status"))["result"]
        assert "corridor: Max had it last; waiting: Bot " in shown(status)


async def test_status_tells_who_it_is_and_what_it_does(tmp_path: Path) -> None:
    async with control(tmp_path) as bench:
        await bench.live(heard(), blocks=12)
        talk = await bench.connect()
        reply = await talk.say(b'{"id": 7, "command": "status"}\n')
        assert reply["id"] == 7
        status = reply["result"]
        assert (status["name"], status["team"], status["version"]) == ("Rob", "plant", __version__)
        assert status["pid"] == os.getpid()
        assert " 95%  20 dB" in shown(status, width=30), "it said 9…"
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
        robot.measures.distances["bot"] = RangeRecord(robot.now - 3.0, "Bot", 2.31416, 0.0243, False)
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


async def test_a_task_is_left_out_and_wanted_again_and_the_others_are_told(tmp_path: Path) -> None:
    async with talking(tmp_path) as (bench, talk):
        for do, refusal in (("skip", "task 1 is left out already"), ("again", "task 1 is still to be done")):
            reply = await talk.ask("task", do=do, number=1)
            assert reply["result"] == {"number": 1, "name": "water the green rose", "do": do}
            assert (await talk.ask("task", do=do, number=1))["error"] == {"code": "refused", "text": refusal}
        assert "there is no task 0" in (await talk.ask("task", do="skip"))["error"]["text"]
        assert (await talk.ask("task", do="paint", number=1))["error"]["code"] == "bad_argument"
        await talk.ask("subscribe", events=["said"])
        await bench.live(blocks=300)
        said = [await talk.line(), await talk.line()]
        assert "Hi all, I am Rob, task one again, change two" in [line["text"] for line in said if line]


async def test_sentences_are_said_in_turn_and_only_those_that_are_true(tmp_path: Path) -> None:
    async with talking(tmp_path) as (bench, talk):
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
        assert "wait to be said" in (await talk.ask("say", text="what is left"))["error"]["text"]
        assert (await talk.ask("say", text="stop"))["ok"]


async def test_events_come_to_who_wants_them_and_readings_only_by_name(tmp_path: Path) -> None:
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
        assert bad["error"]["text"] == "events: there is no 'herd'; did you mean 'heard'?"
        assert (await nothing.ask("subscribe", events=[[]]))["error"]["code"] == "bad_argument"
        assert (await nothing.ask("status"))["ok"], "nothing else came before it"


async def test_the_transcript_comes_in_pages(tmp_path: Path) -> None:
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


async def test_whoever_asks_what_it_does_learns_that_another_robot_has_its_name(tmp_path: Path) -> None:
    """It "is free", and did nothing."""
    async with talking(tmp_path) as (bench, talk):
        for expected in (False, True):
            await bench.live(heard(tuple("hi bot i am rob what is left".split())), blocks=2)
            status = (await talk.ask("status"))["result"]
            assert ("another robot uses its name, so it takes on nothing" in shown(status)) is expected


@pytest.mark.parametrize(
    ("memory", "told"),
    [
        ({"fault": "it is full"}, ["nothing is kept: it is full"]),
        ({"loss": "it is gone"}, ["lost, or not certain, from before this start: it is gone"]),
        (
            {"fault": "a folder", "loss": "a folder"},
            ["nothing is kept, nor known from before this start: a folder"],
        ),
    ],
)
def test_what_is_said_of_a_memory_is_true_and_said_once(memory: dict[str, str], told: list[str]) -> None:
    """A file that could not be read was "lost before this start", and named twice."""
    assert list(memory_faults({"lost": 0, **memory})) == told


async def test_a_memory_that_fails_is_told_as_an_event_and_in_the_status(tmp_path: Path) -> None:
    async with talking(tmp_path) as (bench, talk):
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


async def test_who_asked_for_what_is_in_the_log(tmp_path: Path) -> None:
    async with talking(tmp_path) as (_, talk):
        with capture_logs() as logs:
            await talk.ask("stop")
            await talk.ask("status")
        (line,) = [line for line in logs if line["event"] == "asked to"]
        assert (line["command"], line["uid"], line["pid"]) == ("stop", os.getuid(), os.getpid())


async def test_a_code_that_the_robot_is_to_say_is_not_in_the_log(tmp_path: Path) -> None:
    """Whoever could read the log could use it before the robot had said it, or at any time, where it was refused."""
    async with talking(tmp_path) as (_, talk):
        with capture_logs() as logs:
            await talk.ask("say", text="Hi Bot, I am Rob, water the green rose, code one two three four five six")
        (line,) = [line for line in logs if line["event"] == "asked to"]
        assert line["command"] == "say"
        assert "three four" not in str(logs)
