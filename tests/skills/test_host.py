"""A robot with its control socket, and a host that carries its skills out: from the claim to the pump, and to stop."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from hil_fakes.sound_server import wait_until
from hvcpd.config.skills import MAX_PARAMETERS, MAX_TEXT_LENGTH
from hvcpd.coordination.states import State
from hvcpd.daemon.control_socket import listen_at, short_address
from hvcpd.daemon.skill_hosting import offer
from hvcpd.robot.records import PerformedRecord, SaidRecord
from hvcpd.skills.host import Host
from hvcpd.skills.life import Call
from hvcpd.skills.runners import ProgramRunner, Runner, Tell
from tests.daemon.control_bench import ControlBench, Talk, control, run
from tests.robot.test_hold import BLOCK_S

BOARD = """
skills:
  pour: {parameters: {litres: {least: 0.1, most: 2}}, limit_s: 20, failures: [the tank is empty]}
tasks:
- {number: 1, name: water the green rose, actions: [{pour: 0.5}]}
"""
STOP_S = 0.5


async def until(bench: ControlBench, true: Callable[[], bool], limit_s: float = 300.0) -> None:
    """Live, as fast as the computer can, until it is true."""
    until_s = bench.bench.robot.now + limit_s
    while not true():
        assert bench.bench.robot.now < until_s
        await live(bench)


async def live(bench: ControlBench) -> None:
    await bench.live()
    bench.bench.records += bench.records


async def real_time(bench: ControlBench, true: Callable[[], bool]) -> float:
    """The same as time passes on the wall, because programs in other processes do; how long it took, s."""
    began_s = time.monotonic()
    while not true():
        assert time.monotonic() - began_s < 10.0
        await live(bench)
        await asyncio.sleep(BLOCK_S)
    return time.monotonic() - began_s


def said(bench: ControlBench) -> list[str]:
    return [record.text for record in bench.bench.records if isinstance(record, SaidRecord)]


def performed(bench: ControlBench) -> bool:
    return any(isinstance(record, PerformedRecord) for record in bench.bench.records)


async def hosted(bench: ControlBench, scene: Callable[[], Awaitable[None]], **runners: Runner) -> None:
    """The scene, with a host that offers these."""
    host = Host(runners)
    with short_address(bench.path) as address:
        reader, writer = await asyncio.open_unix_connection(address)
    serving = asyncio.create_task(host.serve(reader, writer))
    try:
        await real_time(bench, lambda: bench.body.skills.offered == set(runners))
        await scene()
    finally:
        writer.close()
        with suppress(asyncio.CancelledError):
            await serving


def scene(directory: Path, play: Callable[[ControlBench], Awaitable[None]]) -> None:
    async def whole() -> None:
        async with control(directory, board=BOARD) as bench:
            await play(bench)

    run(whole())


def test_what_nobody_offers_is_left_to_others_and_taken_once_it_is_offered(tmp_path: Path) -> None:
    async def play(bench: ControlBench) -> None:
        await until(bench, lambda: bench.bench.robot.coordination.state is State.READY)
        for _ in range(400):
            await live(bench)
        talk = await bench.connect()
        status = (await talk.ask("status"))["result"]
        assert status["skills"] == {"offered": [], "missing": ["pour"], "call": None}
        board = (await talk.ask("tasks"))["result"]
        assert (board["tasks"][0]["unable"], board["tasks"][0]["robots"]) == (True, 1)
        assert board["words"] == {"remarks": [], "failures": ["the tank is empty"], "places": []}
        assert not any("i will complete" in text for text in said(bench))

        async def watered() -> None:
            await until(bench, lambda: bench.body.skills.under_way is not None)
            call = (await talk.ask("status"))["result"]["skills"]["call"]
            assert (call["skill"], call["arguments"]) == ("pour", {"litres": 0.5})
            await real_time(bench, lambda: performed(bench))

        await hosted(bench, watered, pour=ProgramRunner(("sh", "-c", f"echo {{litres}} > {tmp_path}/poured")))
        assert (tmp_path / "poured").read_text() == "0.5\n"
        assert bench.body.skills.under_way is None

    scene(tmp_path, play)


def test_a_failed_program_is_told_aloud(tmp_path: Path) -> None:
    async def play(bench: ControlBench) -> None:
        async def failed() -> None:
            await until(bench, lambda: bench.body.skills.under_way is not None)
            await real_time(bench, lambda: bench.body.skills.under_way is None)
            await until(bench, lambda: said(bench)[-1].endswith("task one failed, the tank is empty"), 30.0)

        text = """echo '{"reason": "the tank is empty"}'; exit 1"""
        await hosted(bench, failed, pour=ProgramRunner(("sh", "-c", text)))
        rows = (await (await bench.connect()).ask("transcript"))["result"]["rows"]
        assert any(row["text"] == "pour failed: the tank is empty" for row in rows)

    scene(tmp_path, play)


@pytest.mark.parametrize("how", ["socket", "daemon gone", "robot frozen"])
def test_stop_a_dead_daemon_and_a_frozen_robot_end_a_program_within_half_a_second(how: str, tmp_path: Path) -> None:
    begun, safe = tmp_path / "begun", tmp_path / "safe"

    async def play(bench: ControlBench) -> None:
        async def stopped() -> None:
            await until(bench, lambda: bench.body.skills.under_way is not None)
            await real_time(bench, begun.exists)
            began_s = time.monotonic()
            if how == "socket":
                await (await bench.connect()).ask("stop")
            elif how == "daemon gone":
                await bench.service.close()
            await asyncio.to_thread(wait_until, safe.exists, 5.0, "all is safe")  # nobody lives a block meanwhile
            assert time.monotonic() - began_s < STOP_S + (how == "robot frozen") * 0.1

        program = ProgramRunner(("sh", "-c", f"touch {begun}; exec sleep 60"), ("touch", str(safe)))
        await hosted(bench, stopped, pour=program)

    scene(tmp_path, play)


def test_a_host_that_breaks_off_has_failed(tmp_path: Path) -> None:
    async def play(bench: ControlBench) -> None:
        talk = await bench.connect()
        assert (await talk.ask("offer", skills=["pour"]))["ok"]
        await until(bench, lambda: bench.body.skills.under_way is not None)
        await talk.hang_up()
        await until(bench, lambda: said(bench)[-1].endswith("task one failed"), 30.0)
        assert bench.body.skills.offered == frozenset()

    scene(tmp_path, play)


def test_any_process_may_offer_a_skill_and_only_it_may_tell_of_its_calls(tmp_path: Path) -> None:
    async def play(bench: ControlBench) -> None:
        arm, other = await bench.connect(), await bench.connect()
        assert (await other.ask("offer", skills=["por"]))["error"]["text"].endswith("did you mean 'pour'?")
        await arm.ask("offer", skills=["pour"])
        await until(bench, lambda: bench.body.skills.under_way is not None)
        asked = await next_event(arm, "perform")
        told = {"call": 1, "task": 1, "skill": "pour", "arguments": {"litres": 0.5}, "limit_s": 20.0}
        assert asked == {"event": "perform", **told}
        assert (await other.ask("done", call=1))["error"]["code"] == "refused"
        assert (await arm.ask("progress", call=1, share=2))["error"]["code"] == "bad_argument"
        for wrong in ([1], True, 10**400):
            assert (await arm.ask("done", call=1, results={"litres": wrong}))["error"]["code"] == "bad_argument"
        await arm.ask("progress", call=1, share=0.5, text="half")
        await live(bench)
        call = (await other.ask("status"))["result"]["skills"]["call"]
        assert (call["state"], call["share"], call["text"]) == ("running", 0.5, "half")
        await arm.ask("done", call=1, results={"litres": 0.5})
        await live(bench)
        assert performed(bench)
        assert (await arm.ask("done", call=1))["error"]["code"] == "refused"

    scene(tmp_path, play)


@pytest.mark.parametrize(
    "output",
    [
        """'{"results": {"ok": true}}'""",
        r"""'{"reason": "\ud800 \u001b[31m"}'; exit 1""",
    ],
)
def test_odd_output_of_a_program_ends_neither_the_host_nor_the_robot(output: str, tmp_path: Path) -> None:
    """A result of true ended the host, and half a surrogate, which no file can hold, the daemon."""

    async def play(bench: ControlBench) -> None:
        async def tried() -> None:
            await until(bench, lambda: bench.body.skills.under_way is not None)
            await real_time(bench, lambda: bench.body.skills.under_way is None)
            await bench.live(blocks=100)
            rows = (await (await bench.connect()).ask("transcript"))["result"]["rows"]
            assert performed(bench) or any(row["text"].startswith("pour failed: ? \ufffd[31m") for row in rows)
            assert bench.body.skills.offered == {"pour"}

        await hosted(bench, tried, pour=ProgramRunner(("sh", "-c", f"echo {output}")))

    scene(tmp_path, play)


def test_a_program_that_reports_without_end_is_not_late(tmp_path: Path) -> None:
    """The robot takes a hundred lines a second; "done" came behind all others."""

    async def play(bench: ControlBench) -> None:
        async def tried() -> None:
            await until(bench, lambda: bench.body.skills.under_way is not None)
            assert await real_time(bench, lambda: performed(bench)) < 5.0

        text = "import sys; sys.stdout.write('{\"progress\": 0.5}\\n' * 5000)"
        await hosted(bench, tried, pour=ProgramRunner((sys.executable, "-c", text)))

    scene(tmp_path, play)


def test_who_is_gone_fails_its_call_though_another_offers_the_skill(tmp_path: Path) -> None:
    async def play(bench: ControlBench) -> None:
        arm, other = await bench.connect(), await bench.connect()
        await arm.ask("offer", skills=["pour"])
        await until(bench, lambda: bench.body.skills.under_way is not None)
        await other.ask("offer", skills=["pour"])
        await arm.hang_up()
        await until(bench, lambda: bench.body.skills.under_way is None, 1.0)
        assert bench.body.skills.offered == {"pour"}

    scene(tmp_path, play)


async def next_event(talk: Talk, kind: str) -> dict[str, Any]:
    while (line := await talk.line()) is not None:
        if line.get("event") == kind:
            return line
    raise AssertionError("the daemon has hung up")


class Listened:
    """Notes what it is to do."""

    def __init__(self) -> None:
        self.calls: list[Call] = []

    async def perform(self, call: Call, _tell: Tell) -> dict[str, Any]:
        self.calls.append(call)
        return {}

    def hold(self, on: bool) -> None:
        pass

    async def close(self) -> None:
        pass


def test_a_call_may_have_as_many_arguments_as_long_as_the_task_file_allows(tmp_path: Path) -> None:
    """A line of more than 8 KB ended `hvcpctl skills`, and so did each one after its next start."""
    listened, given = Listened(), {f"p{n}": "\U0001f339" * MAX_TEXT_LENGTH for n in range(MAX_PARAMETERS)}
    perform = {"event": "perform", "call": 1, "task": 1, "skill": "tell", "arguments": given, "limit_s": 5.0}

    async def scene() -> None:
        over = asyncio.Event()

        async def daemon(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            await reader.readline()  # the offer
            writer.write(json.dumps(perform).encode() + b"\n")
            while b"done" not in await reader.readline():
                pass
            writer.close()
            over.set()

        async with await asyncio.start_unix_server(daemon, sock=listen_at(tmp_path / "rob.sock", 0o600, 1)):
            offering = asyncio.create_task(offer(tmp_path / "rob.sock", {"tell": listened}))
            await over.wait()
            offering.cancel()
            with suppress(asyncio.CancelledError):
                await offering

    run(scene())
    assert [dict(call.arguments) for call in listened.calls] == [given]
