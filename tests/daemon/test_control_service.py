"""The control service of a daemon: what it tells and does."""

from __future__ import annotations

import asyncio
import io
import os
from pathlib import Path
from typing import Any

import pytest
from gpiozero.pins.mock import MockFactory
from rich.console import Console
from structlog.testing import capture_logs

from hvcpd import __version__
from hvcpd.config.shared_places import SharedPlace
from hvcpd.console.lines import confidence_note
from hvcpd.control.live.follow_lines import FollowLines
from hvcpd.control.live.status_screen import status_screen
from hvcpd.coordination.peers import PeerDistance
from hvcpd.coordination.place_state import WAITS_S, PlaceState
from hvcpd.coordination.saying import MAX_SENTENCES
from hvcpd.coordination.states import State
from hvcpd.daemon.sound_service import SoundService
from hvcpd.hardware.stop_button import StopButton
from hvcpd.memory.latch import Permit, StopLatch
from hvcpd.ports import STANDSTILL, WheelCommand
from hvcpd.recognition.events import Garbled, Recognised, Urgent
from hvcpd.reporting.metrics import metrics_of
from hvcpd.reporting.text import shown_away
from hvcpd.robot.records import SaidRecord
from tests.daemon.control_bench import ControlBench, control, run
from tests.daemon.test_sound_service import Clock, Streams

ORDER = tuple("hi rob i am bot water the green rose".split())


def heard(words: tuple[str, ...] = ORDER) -> Recognised:
    return Recognised(words, "oak", 0, 8000, 0.95, 20.0, ())


def shown(status: dict[str, Any]) -> str:
    """As `hvcpctl status` shows it."""
    console = Console(width=120, file=io.StringIO())
    console.print(status_screen(status))
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


def test_losses_of_sound_are_told_from_the_first_none_on(tmp_path: Path) -> None:
    """A counter that appears only with the first loss hides that loss from whoever compares two readings."""

    async def scene() -> None:
        async with control(tmp_path) as bench:
            await bench.live(heard(), blocks=12)
            streams = Streams(Clock(), 1)
            bench.body.sound = SoundService(streams.make, streams.clock, streams.clock.sleep)
            status = (await (await bench.connect()).ask("status"))["result"]
            assert status["sound"]["lost"]["card_underflows"] == 0
            assert 'hvcpd_sound_lost_total{robot="Rob",kind="card_underflows"} 0' in metrics_of(status).splitlines()
            assert "underflows" not in shown(status)

    run(scene())


def test_who_has_left_a_place_or_ceased_to_ask_for_it_is_not_shown_to_have_it_or_wait(tmp_path: Path) -> None:
    async def scene() -> None:
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

    run(scene())


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
            robot.coordination.ranged("Bot", PeerDistance(2.31416, 0.0243, False, robot.now - 3.0))
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
            told = {"stopped": False, "kept": True, "reason": None, "untold": None}
            assert (await talk.ask("resume"))["result"] == told | {"before": True}
            assert not starts_stopped(bench), "it is kept when it is answered"
            assert (await talk.ask("resume"))["result"] == told | {"before": False}
            await talk.hang_up()

    run(scene())


def test_a_stop_outdoes_a_resume_of_all_that_was_not_said_yet_and_its_reply_says_so(tmp_path: Path) -> None:
    """Between the console's two requests to the daemon, it left this robot stopped, and had it tell all others to
    resume."""

    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk, robot = await bench.connect(), bench.bench.robot
            await talk.ask("stop")
            resuming = asyncio.create_task(talk.ask("resume", all=True))
            while robot.coordination.knowledge.latched:
                await asyncio.sleep(0)
            robot.coordination.stop(robot.now)
            result = (await resuming)["result"]
            assert (result["before"], result["stopped"], result["untold"]) == (True, True, None)
            said = []
            for _ in range(400):
                await bench.live()
                said += [record.text for record in bench.records if isinstance(record, SaidRecord)]
            assert said
            assert not any("resume" in text for text in said)
            await talk.hang_up()

    run(scene())


def test_while_the_button_is_pressed_nothing_releases_the_robot_and_status_says_why(tmp_path: Path) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            factory = MockFactory()
            bench.body.button = StopButton(17, True, factory)
            factory.pin(17).drive_high()  # its wire is broken
            talk = await bench.connect()
            await talk.ask("stop")
            status = (await talk.ask("status"))["result"]
            assert status["button_pressed"]
            assert "STOPPED: its stop button is pressed" in shown(status)
            refusal = (await talk.ask("resume"))["error"]
            assert refusal["code"] == "refused"
            assert "wire is broken" in refusal["text"]
            assert bench.bench.robot.coordination.state is State.STOPPED
            assert starts_stopped(bench)
            factory.pin(17).drive_low()
            assert not (await talk.ask("status"))["result"]["button_pressed"]
            assert (await talk.ask("resume"))["result"]["before"] is True
            bench.body.button.close()
            await talk.hang_up()

    run(scene())


def test_a_stop_heard_by_itself_is_not_told_as_a_sentence_that_nobody_is_sure_of(tmp_path: Path) -> None:
    """It was "heard, 0 % sure, 0 dB over the noise", and lowered the mean confidence."""

    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            await talk.ask("subscribe", events=["heard"])
            await bench.live(Urgent(0, 8000), blocks=2)
            event = await talk.line()
            assert event is not None
            assert (event["text"], event["confidence"], event["snr_db"]) == ("Stop", None, None)
            line = FollowLines(Console(file=io.StringIO())).line(event, 0.0)
            assert line is not None
            assert line.plain.endswith("somebody: Stop  heard, the word by itself")
            assert confidence_note(event["confidence"], event["snr_db"])["text"] == "heard, the word by itself"
            row, *_ = (await talk.ask("transcript"))["result"]["rows"]
            assert (row["text"], row["confidence"]) == ("Stop", None)
            counts = (await talk.ask("status"))["result"]["counts"]
            assert (counts["heard"], counts["confidence_sum"]) == (0, 0.0)
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
            assert "wait to be said" in (await talk.ask("say", text="what is left"))["error"]["text"]
            assert (await talk.ask("say", text="stop"))["ok"]
            await talk.hang_up()

    run(scene())


@pytest.mark.parametrize(
    ("text", "is_meant"), [("stop", True), ("all stop", True), ("rob stop", True), ("bot stop", False)]
)
def test_a_stop_that_the_robot_is_made_to_say_stops_itself_if_it_is_meant(
    text: str, is_meant: bool, tmp_path: Path
) -> None:
    async def scene() -> None:
        async with control(tmp_path) as bench:
            talk = await bench.connect()
            await talk.ask("subscribe", events=["said"])
            await talk.ask("say", text=text)
            assert (bench.bench.robot.coordination.state is State.STOPPED) is is_meant
            await bench.live(blocks=40)
            await bench.journal.settled()
            assert starts_stopped(bench) is is_meant
            said = await talk.line()
            assert said is not None
            assert said["text"] == text.capitalize()
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
            assert bad["error"]["text"] == "events: there is no 'herd'; did you mean 'heard'?"
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
