"""The way to the robot, over a real control socket."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from hvcpd.console.link import Link
from hvcpd.console.scene import Scene
from hvcpd.console.viewers import Viewers
from hvcpd.coordination.states import State
from hvcpd.errors import NotDoneError, NotRunningError
from hvcpd.reporting.events import Skill, as_json
from tests.console.asking import status
from tests.daemon.control_bench import ControlBench, control
from tests.daemon.test_control_service import heard


async def until(true: Callable[[], bool], bench: ControlBench | None = None) -> None:
    """Let the robot live until something is so."""
    while not true():
        if bench is not None:
            await bench.live()
        await asyncio.sleep(0)


@asynccontextmanager
async def linked(path: Path):  # type: ignore[no-untyped-def]
    scene = Scene(Viewers())
    link = Link(path, scene)
    task = asyncio.create_task(link.run())
    try:
        yield scene, link
    finally:
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task


def is_up(scene: Scene) -> bool:
    return {"kind": "link", "up": True, "text": "Connected to Rob"} in scene.snapshot()["parts"]


def texts(scene: Scene) -> list[str]:
    return [line["text"] for line in scene.lines.page()]


async def test_what_was_said_before_and_what_is_said_now_are_shown_once_each(tmp_path: Path) -> None:
    async with control(tmp_path) as bench:
        await bench.live(heard(), blocks=12)
        await bench.journal.settled()
        async with linked(bench.path) as (shown, _):
            await until(lambda: is_up(shown), bench)
            assert texts(shown).count("Hi Rob, I am Bot, water the green rose") == 1
            assert shown.name == "Rob"
            await bench.live(heard(("bot", "come", "back")))
            await until(lambda: "Bot, come back" in texts(shown), bench)
            assert texts(shown).count("Hi Rob, I am Bot, water the green rose") == 1


async def test_what_becomes_of_a_skill_is_shown(tmp_path: Path) -> None:
    failed = Skill(0.0, "Rob", 1, 1, "pour", "failed", text="the tank is empty", arguments={"litres": 0.25})
    async with control(tmp_path) as bench, linked(bench.path) as (shown, _):
        await until(lambda: is_up(shown), bench)
        bench.service.publish(as_json(failed))
        async with asyncio.timeout(5.0):
            await until(lambda: "pour (litres 0.25): failed, the tank is empty" in texts(shown))


async def test_commands_are_passed_on_with_the_daemons_reason_if_it_refuses(tmp_path: Path) -> None:
    async with control(tmp_path) as bench, linked(bench.path) as (shown, link):
        await until(lambda: is_up(shown), bench)
        assert (await link.ask("stop"))["stopped"] is True
        assert bench.bench.robot.coordination.state is State.STOPPED
        with pytest.raises(NotDoneError, match="only when it is so"):
            await link.ask("say", text="Hi all, I am Rob, task one complete")


async def test_a_daemon_that_ends_is_told_and_found_again(tmp_path: Path) -> None:
    async with linked(tmp_path / "state" / "rob.sock") as (shown, link):
        with pytest.raises(NotRunningError):
            await link.ask("stop")
        async with control(tmp_path) as bench:
            await until(lambda: is_up(shown), bench)
            await bench.live(heard())
            await until(lambda: texts(shown) != [], bench)
        await until(lambda: not is_up(shown))
        with pytest.raises(NotRunningError):
            await link.ask("stop")
        async with control(tmp_path) as again:
            await until(lambda: is_up(shown), again)
            assert texts(shown).count("Hi Rob, I am Bot, water the green rose") == 1


async def test_a_daemon_that_was_there_is_looked_for_at_once_however_often_it_ends(tmp_path: Path) -> None:
    pauses: list[float] = []

    async def pause(seconds: float) -> None:
        pauses.append(seconds)
        await asyncio.sleep(0)

    shown = Scene(Viewers())
    task = asyncio.create_task(Link(tmp_path / "state" / "rob.sock", shown, pause=pause).run())
    for _ in range(4):
        async with control(tmp_path) as bench:
            await until(lambda: is_up(shown), bench)
            pauses.clear()
        await until(lambda: len(pauses) > 1)
        assert pauses[:2] == [0.25, 0.5]
    task.cancel()


@pytest.mark.parametrize("odd", [{"name": None}, {"peers": None}, {"wall_s": "noon"}, {"task": 3}])
async def test_an_answer_of_another_shape_is_told_so_and_looked_at_again(
    odd: dict[str, object], tmp_path: Path
) -> None:
    """The link ended at a name that was none, and the page went on saying that it is connected."""
    visits = 0

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal visits
        visits += 1
        writer.write(b'{"event": "hello", "protocol": 1}\n')
        with suppress(ConnectionError):
            while line := await reader.readline():
                writer.write(
                    json.dumps({"id": json.loads(line)["id"], "ok": True, "result": status(**odd)}).encode() + b"\n"
                )
        writer.close()

    server = await asyncio.start_unix_server(answer, tmp_path / "x.sock")
    async with server, linked(tmp_path / "x.sock") as (shown, _):
        async with asyncio.timeout(10.0):
            await until(lambda: visits > 1)
        link = next(part for part in shown.snapshot()["parts"] if part["kind"] == "link")
        assert not link["up"]
        assert link["text"].startswith("That daemon's answer is unknown here")


@pytest.mark.parametrize(
    "line",
    [
        b"no JSON\n",
        b"[]\n",
        b'{"event": "hello", "protocol": 99}\n',
        b"",
        b'{"event": "hello", "protocol": 1}\n{"ok": 1}\n',
    ],
)
async def test_what_is_no_daemon_is_told_so_and_looked_at_again(line: bytes, tmp_path: Path) -> None:
    visits = 0

    async def answer(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal visits
        visits += 1
        writer.write(line)
        await writer.drain()
        writer.close()

    server = await asyncio.start_unix_server(answer, tmp_path / "x.sock")
    async with server, linked(tmp_path / "x.sock") as (shown, _):
        await until(lambda: visits > 1)
        assert not is_up(shown)
