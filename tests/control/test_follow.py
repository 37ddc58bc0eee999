"""`hvcpctl follow`, on a robot's real socket."""

from __future__ import annotations

import io
import json
import socket
import threading
from contextlib import closing
from pathlib import Path

import pytest
from rich.console import Console

from hvcpd.control.cli import make_parser
from hvcpd.control.live import follow
from hvcpd.control.live.daemon_client import DaemonClient
from hvcpd.control.live.follow_lines import FollowLines
from hvcpd.daemon.control_protocol import PROTOCOL
from hvcpd.errors import BusyError, NotRunningError

STATUS = {"state": "ready", "wall_s": 1000.0, "now_s": 10.0, "name": "Rob"}
HEARD = {
    "event": "heard",
    "at_s": 12.5,
    "speaker": "Bot",
    "text": "Hi all, I am Bot",
    "confidence": 0.97,
    "snr_db": 23.0,
}


class ScriptedDaemon:
    """A daemon's socket: each client is told these events once it has subscribed, and then hung up on."""

    def __init__(self, path: Path, events: list[dict[str, object]], lives: int, busy: int = 0) -> None:
        """`busy`: how many clients it turns away before its last life, as one that has too many does."""
        self._server = socket.socket(socket.AF_UNIX)
        self._server.bind(str(path))
        self._server.listen()
        self._events, self._lives, self._busy = events, lives, busy
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self) -> ScriptedDaemon:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.join(10.0)
        self._server.close()

    def _serve(self) -> None:
        for _ in range(self._lives - 1):
            self._live()
        for _ in range(self._busy):
            client, _ = self._server.accept()
            refusal = {"ok": False, "error": {"code": "busy", "text": "too many clients"}}
            client.sendall(json.dumps(refusal).encode() + b"\n")
            client.close()
        if self._lives:
            self._live()

    def _live(self) -> None:
        asking, hearing = (self._welcome() for _ in range(2))
        self._answer(hearing, {})
        self._answer(asking, STATUS)
        self._answer(asking, {"tasks": [{"number": 1, "name": "water the red rose"}]})
        for event in self._events:
            hearing.sendall(json.dumps(event).encode()[:20])  # a line may come in pieces
            hearing.sendall(json.dumps(event).encode()[20:] + b"\n")
        hearing.close()
        asking.close()

    def _welcome(self) -> socket.socket:
        client, _ = self._server.accept()
        client.sendall(json.dumps({"event": "hello", "protocol": PROTOCOL, "name": "Rob"}).encode() + b"\n")
        return client

    @staticmethod
    def _answer(client: socket.socket, result: object) -> None:
        assert client.recv(4096).endswith(b"\n")
        client.sendall(json.dumps({"ok": True, "result": result}).encode() + b"\n")


def interrupt(_s: float) -> None:
    raise KeyboardInterrupt


def followed(path: Path, *more: str, events: list[dict[str, object]]) -> None:
    options = make_parser().parse_args(["follow", "--socket", str(path), *more])
    with ScriptedDaemon(path, events, lives=1), pytest.raises(KeyboardInterrupt):
        follow.run(options, wait=interrupt)


def test_events_come_as_json_with_the_time_on_the_wall(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    followed(tmp_path / "rob.sock", "--json", events=[HEARD])
    event = json.loads(capsys.readouterr().out)
    assert (event["text"], event["wall_s"]) == (HEARD["text"], 1002.5)


def test_a_pipe_gets_a_line_for_each_event(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changed = {"event": "taskchanged", "at_s": 13.0, "robot": "Rob", "task": 1, "state": "done", "owner": "Bot"}
    followed(tmp_path / "rob.sock", events=[HEARD, changed])
    heard, done, ended = capsys.readouterr().out.splitlines()
    assert heard.endswith("Bot: Hi all, I am Bot  heard, 97 % sure, 23 dB over the noise")
    assert done.endswith("task 1, water the red rose: done by Bot")
    assert ended.endswith("; waiting for it to come back")


def test_without_a_daemon_at_the_start_that_is_said_at_once(tmp_path: Path) -> None:
    with pytest.raises(NotRunningError):
        follow.run(make_parser().parse_args(["follow", "--socket", str(tmp_path / "rob.sock")]))


def test_that_too_many_programs_follow_already_is_said_at_once(tmp_path: Path) -> None:
    options = make_parser().parse_args(["follow", "--json", "--socket", str(tmp_path / "rob.sock")])
    with ScriptedDaemon(tmp_path / "rob.sock", [], lives=0, busy=2), pytest.raises(BusyError, match="too many clients"):
        follow.run(options, wait=lambda _s: None)


def test_the_robot_that_comes_back_is_the_one_that_ended_whatever_the_settings_mean_by_then(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The sentences and tasks of another robot that had been started meanwhile were shown as of this one, also by MQTT,
    whose stop button still stopped this one."""
    file = tmp_path / "hvcpd.yaml"
    file.write_text(f"{{name: Rob, state_dir: {tmp_path}}}")
    waits: list[float] = []

    def wait(seconds: float) -> None:
        waits.append(seconds)
        file.write_text(f"{{name: Bot, state_dir: {tmp_path}}}")
        if len(waits) == 2:
            raise KeyboardInterrupt

    options = make_parser().parse_args(["follow", "--json", "--config", str(file)])
    with ScriptedDaemon(tmp_path / "rob.sock", [HEARD], lives=2), pytest.raises(KeyboardInterrupt):
        follow.run(options, wait)
    assert "Rob is back" in capsys.readouterr().err


@pytest.mark.parametrize("busy", [0, 4])
def test_a_daemon_that_ends_or_then_has_too_many_clients_is_waited_for(
    busy: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = make_parser().parse_args(["follow", "--json", "--socket", str(tmp_path / "rob.sock")])
    waits: list[float] = []

    def wait(seconds: float) -> None:
        waits.append(seconds)
        if len(waits) == 2 + busy // 2:
            raise KeyboardInterrupt

    with ScriptedDaemon(tmp_path / "rob.sock", [HEARD], lives=2, busy=busy), pytest.raises(KeyboardInterrupt):
        follow.run(options, wait)
    out, err = capsys.readouterr()
    assert len(out.splitlines()) == 2, "one event of each life"
    assert err.count("waiting for it to come back") == 2
    assert err.count("Rob is back") == 1


def test_a_frozen_daemon_is_one_that_has_no_time(tmp_path: Path) -> None:
    """A bridge to MQTT ended with a daemon that the watchdog then started again; a button there stopped nobody."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "rob.sock"))
        server.listen()
        with closing(DaemonClient(tmp_path / "rob.sock")) as daemon:
            daemon.patience_s = 0.01
            with pytest.raises(BusyError, match="is it frozen"):
                daemon.ask("subscribe")


def test_an_event_that_comes_in_pieces_is_waited_for(tmp_path: Path) -> None:
    server = socket.socket(socket.AF_UNIX)
    server.bind(str(tmp_path / "rob.sock"))
    server.listen()
    accepted: list[socket.socket] = []

    def accept() -> None:
        client, _ = server.accept()
        client.sendall(json.dumps({"event": "hello", "protocol": PROTOCOL, "name": "Rob"}).encode() + b"\n")
        accepted.append(client)

    thread = threading.Thread(target=accept)
    thread.start()
    daemon = DaemonClient(tmp_path / "rob.sock")
    thread.join()
    accepted[0].sendall(b'{"event": "gar')
    assert daemon.event_within(0.01) is None
    accepted[0].sendall(b'bled"}\n')
    assert daemon.event_within(5.0) == {"event": "garbled"}
    daemon.close()
    accepted[0].close()
    server.close()


@pytest.mark.parametrize(
    ("event", "part"),
    [
        ({"event": "said", "speaker": "Rob", "text": "Stop"}, "Rob: Stop"),
        ({"event": "said", "speaker": "R\x1b[31mob", "text": "Stop\x07"}, "R\N{REPLACEMENT CHARACTER}[31mob: Stop"),
        ({"event": "garbled", "listener": "Rob"}, "was not understood"),
        ({"event": "noted", "robot": "Rob", "speaker": "Bot", "text": "not believed: x\x1b"}, "not believed: x\ufffd"),
        ({"event": "held", "at_s": 1.0, "until_s": 1.5, "robot": "Rob"}, "stood still for 0.5 s"),
        ({"event": "performed", "robot": "Rob", "task": 7}, "Rob has carried out task 7"),
        ({"event": "statechanged", "state": "stopped"}, "stopped: stands"),
    ],
)
def test_each_kind_of_event_has_its_line(event: dict[str, object], part: str) -> None:
    line = FollowLines(Console(file=io.StringIO())).line(event, 0.0)
    assert line is not None
    assert part in line.plain


def test_what_only_the_picture_shows_has_no_line() -> None:
    lines = FollowLines(Console(file=io.StringIO()))
    assert lines.line({"event": "statechanged", "state": "ready"}, 0.0) is None
    assert lines.line({"event": "of another version"}, 0.0) is None
