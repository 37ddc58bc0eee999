"""`hvcpctl range` asks through a robot's socket, and waits for what is measured."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hvcpd.control.cli import main
from hvcpd.errors import EX_USER
from tests.control.obliging import obliging_robot

AWAY = {"event": "noted", "robot": "Rob", "speaker": "Bot", "text": "Bot is 3.42 m away, ± 0.03 m"}
STATUS = {"peers": [{"name": "Bot", "away": {"distance_m": 3.42, "deviation_m": 0.03, "sure": True, "ago_s": 0.1}}]}
OTHERS = [
    {"event": "heard", "robot": "Rob", "speaker": "Max", "text": "Hi Bot, I am Max, I cannot measure it"},
    {"event": "heard", "robot": "Rob", "speaker": "Bot", "text": "Hi Rob, I am Bot, I will measure it"},
    {"event": "noted", "robot": "Rob", "speaker": "Bot", "text": "another voice than Bot's: oak, not elm"},
]


def ranged(
    tmp_path: Path, events: list[dict[str, Any]], *more: str, robot: str = "bot"
) -> tuple[int, list[dict[str, Any]]]:
    """The exit status of a robot that tells these events once it is to speak, and what it was asked."""
    requests: list[dict[str, Any]] = []

    def answer(request: dict[str, Any]) -> Iterator[dict[str, Any]]:
        requests.append(request)
        yield {"ok": True, "result": STATUS if request["command"] == "status" else {}}
        yield from events if request["command"] == "say" else ()

    with obliging_robot(tmp_path, answer):
        return main(["range", robot, "--socket", str(tmp_path / "rob.sock"), *more]), requests


def test_it_asks_aloud_and_tells_the_distance(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, requests = ranged(tmp_path, [*OTHERS, AWAY])
    assert status == 0
    assert requests[2]["text"] == "Hi Bot, I am Rob, how far are you"
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
    status, requests = ranged(tmp_path, [], robot=robot)
    assert status == EX_USER
    assert [request["command"] for request in requests] == ["status"]
    assert "it knows Bot" in capsys.readouterr().err
