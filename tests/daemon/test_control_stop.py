"""Stop and resume by the control socket."""

from __future__ import annotations

import asyncio
import io
import json
import socket
import threading
from pathlib import Path

import numpy as np
import pytest
from gpiozero.pins.mock import MockFactory
from rich.console import Console

from hvcpd.console.lines import confidence_note
from hvcpd.control.cli import main
from hvcpd.control.live.follow_lines import FollowLines
from hvcpd.coordination.states import State
from hvcpd.daemon.base_request_handler import BaseRequestHandler
from hvcpd.daemon.control_protocol import PROTOCOL
from hvcpd.daemon.control_socket import short_address
from hvcpd.hardware.ros_base import RosBase
from hvcpd.hardware.stop_button import StopButton
from hvcpd.memory.latch import Permit, StopLatch
from hvcpd.ports import STANDSTILL, WheelCommand
from hvcpd.recognition.events import Urgent
from hvcpd.robot.records import SaidRecord
from tests.daemon.control_bench import ControlBench, control, talking
from tests.daemon.test_control_service import shown


async def spoken(bench: ControlBench) -> list[str]:
    """What the robot says in the next 400 blocks."""
    said = []
    for _ in range(400):
        await bench.live()
        said += [record.text for record in bench.records if isinstance(record, SaidRecord)]
    return said


def starts_stopped(bench: ControlBench) -> bool:
    """Whether the latch, as it is on the disk, would have the next start stopped."""
    latched = StopLatch(bench.body.wiring.latch_path).read()
    return latched is None or latched.permit is not Permit.FREE


async def test_stop_halts_the_wheels_before_the_next_block_and_is_said_aloud(tmp_path: Path) -> None:
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


async def test_a_stop_outdoes_a_resume_of_all_that_was_not_said_yet_and_its_reply_says_so(tmp_path: Path) -> None:
    """Between the console's two requests to the daemon, it left this robot stopped, and had it tell all others to
    resume."""
    async with control(tmp_path) as bench:
        talk, robot = await bench.connect(), bench.bench.robot
        await talk.ask("stop")
        resuming = asyncio.create_task(talk.ask("resume", all=True))
        while robot.coordination.knowledge.latched:
            await asyncio.sleep(0)
        robot.coordination.stop(robot.now)
        result = (await resuming)["result"]
        assert (result["before"], result["stopped"], result["untold"]) == (True, True, None)
        said = await spoken(bench)
        assert said
        assert not any("resume" in text for text in said)


async def test_the_reply_to_a_stop_that_was_undone_meanwhile_says_so(tmp_path: Path) -> None:
    async with control(tmp_path) as bench:
        talk, robot = await bench.connect(), bench.bench.robot
        stopping = asyncio.create_task(talk.ask("stop"))
        while not robot.coordination.knowledge.latched:
            await asyncio.sleep(0)
        robot.coordination.resume(robot.now)
        result = (await stopping)["result"]
        assert (result["before"], result["stopped"]) == (False, False)


async def test_while_the_button_is_pressed_nothing_releases_the_robot_and_status_says_why(tmp_path: Path) -> None:
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
        bench.bench.robot.is_held_down = True  # as the main loop sees it
        for text in ("hi bot, i am rob, what is left", "bot resume"):
            await talk.ask("say", text=text)
        assert "Bot resume" in await spoken(bench), "that is for another one"
        bench.bench.robot.is_held_down = False
        assert bench.bench.robot.coordination.state is State.STOPPED
        assert starts_stopped(bench)
        factory.pin(17).drive_low()
        assert not (await talk.ask("status"))["result"]["button_pressed"]
        assert (await talk.ask("resume"))["result"]["before"] is True
        bench.body.button.close()


@pytest.mark.parametrize("leaves_first", [False, True])
async def test_who_is_stopped_is_shown_as_that_while_it_leaves(leaves_first: bool, tmp_path: Path) -> None:
    """It was "leaving"; ROS was told that nothing stopped it, and others could drive its base."""
    async with control(tmp_path) as bench:
        robot = bench.bench.robot
        base = BaseRequestHandler(RosBase())
        talk, events = await bench.connect(), await bench.connect()
        await events.ask("subscribe", events=["statechanged"])
        if leaves_first:
            robot.coordination.leave(robot.now)
            await bench.live()
        await talk.ask("stop")
        await bench.live()
        robot.coordination.leave(robot.now)
        await bench.live()
        await events.line()
        event = await events.line()
        assert event is not None
        assert (event["state"], "leaves" in event["doing"]) == ("stopped", True)
        status = (await talk.ask("status"))["result"]
        assert (status["state"], status["stopped"]) == ("stopped", True)
        assert "leaves" in status["doing"]
        assert "STOPPED" in shown(status)
        drive = base.drive(robot, STANDSTILL)
        assert drive is not None
        assert drive.stopped


async def test_a_stop_heard_by_itself_is_not_told_as_a_sentence_that_nobody_is_sure_of(tmp_path: Path) -> None:
    """It was "heard, 0 % sure, 0 dB over the noise", and lowered the mean confidence."""
    async with talking(tmp_path) as (bench, talk):
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


async def test_a_stop_before_the_robot_is_there_is_not_forgotten(tmp_path: Path) -> None:
    async with talking(tmp_path, with_robot=False) as (bench, talk):
        bench.body.preparation.text = "preparing words: Bot's words, 3 of 97"
        status = (await talk.ask("status"))["result"]
        assert status["state"] == "starting"
        assert "Bot's words, 3 of 97" in shown(status)
        assert "not opened yet" in shown(status), "it has wheels"
        assert (await talk.ask("tasks"))["error"]["code"] == "starting"
        assert (await talk.ask("reload"))["error"]["code"] == "starting", "the plan is made of what was read before"
        assert (await talk.ask("stop"))["result"]["before"] is False
        assert "STOPPED" in shown((await talk.ask("status"))["result"])
        assert (await talk.ask("stop"))["result"]["before"] is True
        bench.begin()
        assert (await talk.ask("status"))["result"]["stopped"] is True


@pytest.mark.parametrize(("asked", "stops"), [({"command": "stop"}, True), ({"command": "say", "text": "stop"}, False)])
async def test_of_what_was_asked_of_a_frozen_daemon_a_stop_alone_still_counts(
    tmp_path: Path, asked: dict[str, str], stops: bool
) -> None:
    """`hvcpctl stop` had given up when the daemon went on, and so did the robot."""
    async with control(tmp_path) as bench:
        with socket.socket(socket.AF_UNIX) as connection, short_address(bench.path) as address:
            connection.connect(address)
            connection.sendall(json.dumps(asked).encode() + b"\n")
        talk = await bench.connect()
        await talk.ask("status")  # it came later
        assert (bench.bench.robot.coordination.state is State.STOPPED) is stops


@pytest.mark.parametrize(
    ("text", "is_meant"), [("stop", True), ("all stop", True), ("rob stop", True), ("bot stop", False)]
)
async def test_a_stop_that_the_robot_is_made_to_say_stops_itself_if_it_is_meant(
    text: str, is_meant: bool, tmp_path: Path
) -> None:
    async with talking(tmp_path) as (bench, talk):
        await talk.ask("subscribe", events=["said"])
        await talk.ask("say", text=text)
        assert (bench.bench.robot.coordination.state is State.STOPPED) is is_meant
        await bench.live(blocks=40)
        await bench.journal.settled()
        assert starts_stopped(bench) is is_meant
        said = await talk.line()
        assert said is not None
        assert said["text"] == text.capitalize()


@pytest.mark.parametrize("is_deaf", [False, True])
async def test_a_stop_for_others_that_the_robot_cannot_say_now_is_told_as_such(is_deaf: bool, tmp_path: Path) -> None:
    """The console reported that the robot says "stop" to all others; it had no sound, or its words were not ready."""
    async with control(tmp_path) as bench:
        talk, robot = await bench.connect(), bench.bench.robot
        robot.is_silent = not is_deaf
        await bench.live()
        if is_deaf:
            robot.step(np.zeros(0, np.float32), None, 1600)
        refusal = (await talk.ask("say", text="stop"))["error"]
        assert refusal["text"] == "Rob has no sound, or its words are not ready yet: it calls nobody now"
        assert robot.coordination.state is State.STOPPED
        robot.is_silent = False
        assert "Stop" in await spoken(bench), "it can, soon after"


@pytest.mark.parametrize(
    ("command", "stopped", "told"),
    [("resume", True, "Rob was stopped again"), ("stop", False, "Rob was released")],
)
def test_what_somebody_has_outdone_says_so(
    command: str, stopped: bool, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It said that the robot took on tasks again, or that it stood still."""
    reply = {"stopped": stopped, "before": True, "kept": True, "reason": None, "untold": None}
    lines = ({"event": "hello", "protocol": PROTOCOL, "name": "Rob"}, {"ok": True, "result": reply})
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "rob.sock"))
        listening.listen()

        def serve() -> None:
            with listening.accept()[0] as client, client.makefile("rw") as stream:
                stream.writelines(json.dumps(line) + "\n" for line in lines)
                stream.flush()
                stream.readlines()

        thread = threading.Thread(target=serve)
        thread.start()
        assert main([command, "--socket", str(tmp_path / "rob.sock")]) == 1
        thread.join()
    assert capsys.readouterr() == ("", f"hvcpctl: {told} meanwhile\n")
