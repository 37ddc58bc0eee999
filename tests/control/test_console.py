"""`hvcpctl console`, as a person types it."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
from http.client import HTTPConnection
from pathlib import Path

import pytest

from hvcpd.console.serve import SOCKET_MODE, is_loopback, open_file
from hvcpd.control.cli import main
from hvcpd.errors import ConfigError
from hvcpd.reporting.transcript import write_transcript
from tests.processes import python
from tests.reporting.example import example


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--listen", "10.0.0.1"], "add --expose"),
        (["--listen", "fd00::1"], "add --expose"),
        (["--listen", "0.0.0.0", "--expose"], "give one address of this computer"),
        (["--listen", "everywhere"], "give one address of this computer"),
        (["--replay", "nowhere", "--port", "0"], "simulate --report"),
        (["--listen", "192.0.2.1", "--expose", "--port", "0"], "cannot serve a page at 192.0.2.1"),
        (["--unix", "/nowhere/x.sock"], "--unix /nowhere/x.sock"),
    ],
)
def test_a_wrong_option_is_told_with_the_remedy(
    arguments: list[str], part: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["console", *arguments]) == 2
    assert part in capsys.readouterr().err


def test_a_port_that_is_in_use_is_told_in_plain_words(capsys: pytest.CaptureFixture[str]) -> None:
    """It had "(while attempting to bind on address ('127.0.0.1', 8765))" in it."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        assert main(["console", "--port", str(port)]) == 2
    text = f"cannot serve a page at 127.0.0.1, port {port}: Address already in use; choose another with --port\n"
    assert text in capsys.readouterr().err


def test_without_a_daemon_there_is_nothing_to_show(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["console", "--port", "0", "--socket", str(tmp_path / "rob.sock")]) == 3
    assert "no daemon answers" in capsys.readouterr().err


def test_what_is_loopback() -> None:
    assert all(map(is_loopback, ("127.0.0.1", "127.8.8.8", "::1")))
    assert not any(map(is_loopback, ("192.0.2.1", "10.0.0.1", "fd00::1")))


def test_a_socket_that_was_left_is_replaced_and_one_in_use_is_not(tmp_path: Path) -> None:
    path = tmp_path / "page.sock"
    left = socket.socket(socket.AF_UNIX)
    left.bind(str(path))
    left.close()
    with open_file(path):
        assert path.stat().st_mode & 0o777 == SOCKET_MODE
        with pytest.raises(ConfigError, match="another console"), open_file(path):
            pass
    assert not path.exists()
    path.write_text("mine")
    with pytest.raises(ConfigError, match="not a socket"), open_file(path):
        pass
    assert path.read_text() == "mine"


class UnixConnection(HTTPConnection):
    """HTTP over a UNIX socket."""

    def __init__(self, path: Path) -> None:
        super().__init__("localhost")
        self._path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.connect(str(self._path))


@pytest.mark.slow
def test_a_mission_is_served_in_a_unix_socket_until_interrupted(tmp_path: Path) -> None:
    write_transcript(example(sound=False).events, tmp_path / "transcript.jsonl")
    path = tmp_path / "page.sock"
    words = ("-m", "hvcpd.control.cli", "console", "--replay", str(tmp_path), "--unix", str(path))
    with python(*words, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert "ssh -L" in process.stdout.readline()
        connection = UnixConnection(path)
        connection.request("GET", "/replay")
        assert json.loads(connection.getresponse().read())["has_sound"] is False
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=20.0)
    assert "Traceback" not in err
    assert not path.exists()
