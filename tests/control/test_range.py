"""`hvcpctl range` asks through a robot's socket, and waits for what is measured."""

from __future__ import annotations

import json
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

from hvcpd.control.cli import main
from hvcpd.errors import EX_USER

AWAY = {"event": "noted", "robot": "Rob", "speaker": "Bot", "text": "Bot is 3.42 m away, ± 0.03 m"}
STATUS = {"peers": [{"name": "Bot", "away": {"distance_m": 3.42, "deviation_m": 0.03, "sure": True, "ago_s": 0.1}}]}
OTHERS = [
    {"event": "heard", "robot": "Rob", "speaker": "Max", "text": "Hi Bot, I am Max, I cannot measure it"},
    {"event": "heard", "robot": "Rob", "speaker": "Bot", "text": "Hi Rob, I am Bot, I will measure it"},
    {"event": "noted", "robot": "Rob", "speaker": "Bot", "text": "another voice than Bot's: oak, not elm"},
]


class FakeDaemon:
    """A robot's socket, which answers every request and then tells these events."""

    def __init__(self, path: Path, events: list[dict[str, Any]]) -> None:
        self.requests: list[dict[str, Any]] = []
        self._events = events
        self._listening = socket.socket(socket.AF_UNIX)
        self._listening.bind(str(path))
        self._listening.listen()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        with self._listening, self._listening.accept()[0] as client, client.makefile("rw", encoding="utf-8") as lines:

            def tell(line: dict[str, Any]) -> None:
                lines.write(json.dumps(line) + "\n")
                lines.flush()

            tell({"event": "hello", "protocol": 1, "name": "Rob", "version": "1"})
            while line := lines.readline():  # until the client has gone
                self.requests.append(request := json.loads(line))
                tell({"ok": True, "result": STATUS if request["command"] == "status" else {}})
                for event in self._events if request["command"] == "say" else ():
                    tell(event)

    def join(self) -> None:
        self._thread.join(10.0)


def ranged(tmp_path: Path, events: list[dict[str, Any]], *more: str, robot: str = "bot") -> tuple[int, FakeDaemon]:
    path = tmp_path / "s"
    daemon = FakeDaemon(path, events)
    status = main(["range", robot, "--socket", str(path), *more])
    daemon.join()
    return status, daemon


def test_it_asks_aloud_and_tells_the_distance(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, daemon = ranged(tmp_path, [*OTHERS, AWAY])
    assert status == 0
    assert daemon.requests[2]["text"] == "Hi Bot, I am Rob, how far are you"
    assert capsys.readouterr().out == "Bot is 3.42 m away, ± 0.03 m\n"


def test_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert ranged(tmp_path, [AWAY], "--json")[0] == 0
    assert json.loads(capsys.readouterr().out) == {
        "robot": "Bot",
        "distance_m": 3.42,
        "deviation_m": 0.03,
        "sure": True,
        "ago_s": 0.1,
    }


def test_a_robot_that_cannot_measure_is_told_as_not_done(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    refusal = {"event": "heard", "robot": "Rob", "speaker": "Bot", "text": "Hi Rob, I am Bot, I cannot measure it"}
    assert ranged(tmp_path, [*OTHERS, refusal])[0] == 1
    assert "ask again" in capsys.readouterr().err


@pytest.mark.parametrize("robot", ["Rob", "Anna", "", "all", "Bot please"])
def test_who_is_no_robot_that_was_heard_is_not_asked(
    robot: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, daemon = ranged(tmp_path, [], robot=robot)
    assert status == EX_USER
    assert [request["command"] for request in daemon.requests] == ["status"]
    assert "it knows Bot" in capsys.readouterr().err
