"""The package for a Raspberry Pi, run here: its own Python and libraries under qemu-user, beside fakes."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.ciphers.aead import AESCCM

from release import arm64
from release.deb import REPOSITORY

pytestmark = [pytest.mark.arm64, pytest.mark.slow]

SENTENCE = "Hi Rob, I am Bot, water the yellow rose"
PATIENCE_S = 1800.0
"""For one command, also where other work has most of the processor: alone the longest takes 190 s."""
TWO_TASKS = """\
tasks:
  - {number: 1, name: water the yellow rose, actions: [forward: 0.1]}
  - {number: 2, name: water the green rose, actions: [forward: 0.1]}
"""
ONE_TASK = "tasks:\n  - {number: 1, name: water the yellow rose, actions: [forward: 0.2, wait: 1]}\n"


@pytest.fixture(scope="session")
def pi(request: pytest.FixtureRequest, index: None) -> Path:
    """The root of a Debian for arm64 with the package in it."""
    assert request.config.cache is not None
    folder = request.config.cache.mkdir("arm64")
    try:
        root = arm64.make_root(folder)
    except arm64.UnavailableError as error:
        pytest.skip(str(error))
    arm64.put_hvcpd(root, folder)
    return root


def command(pi: Path, program: str, *arguments: str) -> list[str]:
    module = {"hvcpd": "hvcpd.cli", "hvcpctl": "hvcpd.control.cli"}[program]
    return arm64.command(pi, ["-c", f"import sys; from {module} import main; sys.exit(main())", *arguments])


def ran(pi: Path, program: str, *arguments: str, status: int = 0) -> str:
    done = subprocess.run(
        command(pi, program, *arguments),
        env=arm64.environment(pi),
        cwd=pi,  # where no other hvcpd lies
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout + done.stderr


def settings(folder: Path) -> str:
    tasks, config = folder / "tasks.yaml", folder / "hvcpd.yaml"
    tasks.write_text(ONE_TASK)
    (folder / "state").mkdir(exist_ok=True)
    config.write_text(f"name: Rob\ntasks: {tasks}\nstate_dir: {folder / 'state'}\nwheels: {{driver: none}}\n")
    return str(config)


def test_it_says_what_it_hears(pi: Path, tmp_path: Path) -> None:
    wav = str(tmp_path / "yellow.wav")
    ran(pi, "hvcpctl", "say", SENTENCE, "-o", wav)
    assert SENTENCE in ran(pi, "hvcpctl", "hear", wav)


def test_the_check_finds_all_but_a_sound_card(pi: Path, tmp_path: Path) -> None:
    told = ran(pi, "hvcpd", "--check", "--config", settings(tmp_path), status=os.EX_UNAVAILABLE)
    assert "ok  vocabulary: tasks and names sound different enough" in told
    assert "1 task in" in told


def test_two_robots_share_two_tasks_by_voice_and_drive_them_with_fake_motors(pi: Path, tmp_path: Path) -> None:
    tasks = tmp_path / "tasks.yaml"
    tasks.write_text(TWO_TASKS)
    mission = ran(pi, "hvcpctl", "simulate", "--tasks", str(tasks), "--json")
    summary = json.loads(mission.splitlines()[-1])
    assert summary["done"].keys() == {"water the yellow rose", "water the green rose"}
    assert (summary["lost"], summary["duplicates"]) == (0, 0)


def test_a_sealed_sentence_is_encrypted_by_debians_library(pi: Path) -> None:
    program = "from hvcpd.security.cipher import _aead; print(_aead(bytes(16)).encrypt(bytes(13), b'go', None).hex())"
    done = subprocess.run(
        arm64.command(pi, ["-c", program]),
        env=arm64.environment(pi),
        cwd=pi,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == AESCCM(bytes(16), tag_length=4).encrypt(bytes(13), b"go", None).hex()


def test_a_robot_comes_up_and_tells_its_status(pi: Path, tmp_path: Path) -> None:
    config, ready = settings(tmp_path), tmp_path / "notify"
    environment = {**arm64.environment(pi), "NOTIFY_SOCKET": str(ready)}
    environment["PYTHONPATH"] += f":{REPOSITORY}"  # for the quiet room; hvcpd is the package's
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notified:
        notified.bind(str(ready))
        notified.settimeout(PATIENCE_S)
        robot = subprocess.Popen(
            arm64.command(pi, ["-m", "tests.daemon.quiet_robot", "--config", config]), env=environment, cwd=pi
        )
        try:
            while b"READY=1" not in notified.recv(65_536):
                assert robot.poll() is None
            assert "Rob" in ran(pi, "hvcpctl", "status", "--config", config)
        finally:
            robot.send_signal(signal.SIGKILL)
            robot.wait()
