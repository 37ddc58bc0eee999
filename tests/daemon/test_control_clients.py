"""The control socket of a daemon: what bad clients cannot do, and where it has no place."""

from __future__ import annotations

import asyncio
import json
import shutil
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st
from structlog.testing import capture_logs

from hvcpd.daemon.control_lobby import MAX_WAITING
from hvcpd.daemon.control_protocol import MAX_LINE_BYTES, Request
from hvcpd.daemon.control_server import MAX_CLIENTS, MAX_FOLLOWERS, MAX_UNREAD_BYTES, Client, ControlServer
from hvcpd.errors import RunningError
from tests.daemon.control_bench import ControlBench, Talk, control
from tests.daemon.test_control_service import ORDER


async def lives_on(bench: ControlBench, other: Talk) -> None:
    """The robot takes its blocks, and another client is served."""
    await bench.live(blocks=2)
    assert (await other.ask("status"))["ok"]


async def test_who_does_not_read_is_let_go_and_holds_nobody_up(tmp_path: Path) -> None:
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


async def test_a_line_too_long_and_a_line_cut_short_end_only_their_client(tmp_path: Path) -> None:
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


async def test_places_are_kept_for_who_has_something_to_ask(tmp_path: Path) -> None:
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


async def test_a_stop_does_not_wait_for_what_its_client_asked_for_before(tmp_path: Path) -> None:
    """It waited while the words of a new task were compared, on a Raspberry Pi for 20 s, and the robot drove on."""
    compared = asyncio.Event()

    async def serve(request: Request, _: Client) -> dict[str, str]:
        if request.command == "task":
            await compared.wait()
        return {"done": request.command}

    server = ControlServer(serve, lambda: {"event": "hello"}, lambda _: None)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(tmp_path / "a.sock"))
    listener.listen()
    server.open(listener)
    talk, other, crowd = [Talk(*await asyncio.open_unix_connection(tmp_path / "a.sock")) for _ in range(3)]
    stopped = await talk.say(b'{"id": 1, "command": "task"}\n{"id": 2, "command": "stop"}\n')
    assert stopped == {"id": 2, "ok": True, "result": {"done": "stop"}}
    refused = await crowd.say(b'{"id": 4, "command": "task"}\n' * 8 + b'{"id": 5, "command": "status"}\n')
    assert (refused["id"], refused["error"]["code"]) == (5, "busy")
    assert (await crowd.say(b'{"id": 6, "command": "stop"}\n'))["result"] == {"done": "stop"}
    in_order = asyncio.create_task(other.say(b'{"command": "task"}\n{"command": "tasks"}\n'))
    for _ in range(3):
        await talk.say(b'{"id": 3, "command": "status"}\n')
    compared.set()
    assert (await in_order)["result"] == {"done": "task"}
    assert (await talk.line() or {})["id"] == 1
    await talk.hang_up()
    await other.hang_up()
    await crowd.hang_up()
    await server.close()


async def test_a_second_daemon_of_the_name_does_not_start(tmp_path: Path) -> None:
    async with control(tmp_path) as bench:
        second = ControlBench(tmp_path)
        with pytest.raises(RunningError, match="already runs on this computer"):
            await second.service.open()
        await second.service.close()
        second.service.release()
        talk = await bench.connect()
        await lives_on(bench, talk)


async def test_without_a_place_for_the_socket_the_robot_lives_on(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with capture_logs() as logs:
        async with control(tmp_path, **{"control.socket": str(tmp_path / "file" / "rob.sock")}) as bench:
            await bench.live(blocks=2)
    (warning,) = [line for line in logs if line["event"] == "no control socket"]
    assert "control.socket" in warning["remedy"]
    (tmp_path / "rob.sock.lock").mkdir()
    with capture_logs() as logs:
        async with control(tmp_path, **{"control.socket": str(tmp_path / "rob.sock")}):
            pass
    (warning,) = [line for line in logs if line["event"] == "no control socket"]
    assert (warning["path"], warning["reason"]) == (str(tmp_path / "rob.sock.lock"), "Is a directory")
    async with control(tmp_path, **{"control.enabled": False}) as bench:
        assert not bench.path.exists()
        await bench.live(blocks=2)


async def test_a_socket_whose_folder_is_removed_is_made_again_as_soon_as_it_can_be(tmp_path: Path) -> None:
    """A robot that was started in a terminal could not be stopped by command after its user had logged out."""
    runtime = tmp_path / "run"
    runtime.mkdir()
    async with control(tmp_path, **{"control.socket": str(runtime / "hvcpd" / "rob.sock")}) as bench:
        before = await bench.connect()
        shutil.rmtree(runtime)
        runtime.write_text("no folder can be made here")
        with capture_logs() as logs:
            await bench.live(blocks=600)
        assert [line["event"] for line in logs] == ["no control socket"]
        runtime.unlink()
        await bench.live(blocks=300)
        talk = await bench.connect()
        assert (await talk.ask("stop"))["ok"]
        assert (await before.ask("status"))["result"]["stopped"]


async def test_a_socket_of_another_daemon_is_left_alone(tmp_path: Path) -> None:
    async with control(tmp_path) as bench:
        shutil.rmtree(tmp_path / "state")
        second = ControlBench(tmp_path)
        await second.open()
        await bench.live(blocks=300)
        talk = await second.connect()
        assert (await talk.ask("status"))["ok"]
        await talk.hang_up()
        bench.service.release()
        assert second.path.exists()
        await second.close()


async def test_who_says_nothing_takes_nobodys_place(tmp_path: Path) -> None:
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

    with capture_logs() as logs:
        runner.run(asyncio.wait_for(scene(), 30.0))
    assert not [line for line in logs if line["log_level"] == "error"]
