"""The package for a Raspberry Pi, run here: its own Python and libraries under qemu-user, beside fakes."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from cryptography.hazmat.primitives.ciphers.aead import AESCCM

from hvcpd.synthesis.voices import VOICES
from release import arm64
from release.libraries import REPOSITORY

pytestmark = [pytest.mark.arm64, pytest.mark.slow]

SENTENCE = "Hi Rob, I am Bot, water the yellow rose"
PATIENCE_S = 600
"""Processor time for one command, s. Time by the clock would measure this computer's other work, too. The emulator does
arithmetic by software, about 50 times slower than this computer."""
LIMITED = ("prlimit", f"--cpu={PATIENCE_S}")
"""Of util-linux, which every Debian has."""
WORDS = ("eight", "taken")
"""A final stop, and noise between voiced sounds."""
AGREED_DB = -60.0
"""Peers hear each other by waveforms that each renders for itself; so far below, a difference is beneath any noise."""
RENDER = """
import sys
import numpy as np
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES
lexicon = Lexicon.load()
units = [unit for voice in VOICES for word in sys.argv[2:] for _, unit in Speaker(voice, lexicon).keyed(word)]
np.savez(sys.argv[1], *units)
"""
LOAD_ALL = """
from importlib import import_module
from pkgutil import walk_packages
for name in ("hvcpd", "hil_fakes"):
    for module in walk_packages(import_module(name).__path__, f"{name}."):
        if not module.name.endswith(".__main__"):
            try:
                import_module(module.name)
            except ModuleNotFoundError as error:
                assert error.name == "gpiozero", error  # Debian's
    print(name)
"""
LARGEST_BYTES, BLOCK_BYTES = 80_000_000, 4_096
"""Of a card, for the package with what its installation compiles; and what the card gives at a time."""
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


@pytest.fixture(autouse=True, scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A cache of rendered units that this computer fills and the emulated one reads, as one renders units 50 times as
    fast as the other. That both render the same is a test of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


def command(pi: Path, program: str, *arguments: str) -> list[str]:
    module = {"hvcpd": "hvcpd.cli", "hvcpctl": "hvcpd.control.cli"}[program]
    return arm64.command(pi, ["-c", f"import sys; from {module} import main; sys.exit(main())", *arguments])


def ran(pi: Path, program: str, *arguments: str, status: int = 0) -> str:
    return completed(pi, command(pi, program, *arguments), status)


def ran_on_both(pi: Path, *arguments: str) -> tuple[str, str]:
    """What hvcpctl prints on this computer, which renders, and there."""
    words = [sys.executable, "-m", "hvcpd.control.cli", *arguments]
    here = subprocess.run(words, check=True, capture_output=True, text=True, cwd=REPOSITORY).stdout
    return here, ran(pi, "hvcpctl", *arguments)


def completed(pi: Path, words: list[str], status: int = 0) -> str:
    """What a command prints there, which must end with this status."""
    done = subprocess.run(
        [*LIMITED, *words],
        env=arm64.environment(pi),
        cwd=pi,  # where no other hvcpd lies
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout + done.stderr


def is_ready(notified: socket.socket) -> bool:
    """Whether the next message to systemd, if there is one now, says so."""
    try:
        return b"READY=1" in notified.recv(65_536)
    except TimeoutError:
        return False


def tasks(folder: Path) -> Path:
    path = folder / "tasks.yaml"
    path.write_text(ONE_TASK)
    return path


@pytest.fixture(scope="session")
def settings(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The settings of a robot whose state folder keeps what the check has found for its start."""
    folder = tmp_path_factory.mktemp("robot")
    config = folder / "hvcpd.yaml"
    (folder / "state").mkdir()
    config.write_text(f"name: Rob\ntasks: {tasks(folder)}\nstate_dir: {folder / 'state'}\nwheels: {{driver: none}}\n")
    return str(config)


def test_it_takes_up_no_more_of_the_card_than_it_may(pi: Path, tmp_path: Path) -> None:
    (package,) = pi.parent.glob("hvcpd_*.deb")
    subprocess.run(["dpkg-deb", "--extract", package, tmp_path], check=True)
    arm64.compile_hvcpd(tmp_path)
    sizes = [path.lstat().st_size for path in tmp_path.rglob("*")]
    assert sum(-(-size // BLOCK_BYTES) * BLOCK_BYTES for size in sizes) <= LARGEST_BYTES


def test_every_module_finds_what_it_needs_in_the_package(pi: Path) -> None:
    assert completed(pi, arm64.command(pi, ["-c", LOAD_ALL])).split() == ["hvcpd", "hil_fakes"]


def test_it_says_what_it_hears(pi: Path, tmp_path: Path) -> None:
    wav = str(tmp_path / "yellow.wav")
    ran(pi, "hvcpctl", "say", SENTENCE, "-o", wav)
    here, there = ran_on_both(pi, "hear", wav, "--tasks", str(tasks(tmp_path)))
    assert SENTENCE in here
    assert there == here


def test_every_voice_sounds_as_it_does_on_this_computer(pi: Path, tmp_path: Path) -> None:
    theirs, ours = tmp_path / "arm64.npz", tmp_path / "here.npz"
    completed(pi, arm64.command(pi, ["-c", RENDER, str(theirs), *WORDS]))
    subprocess.run([sys.executable, "-c", RENDER, str(ours), *WORDS], check=True, cwd=REPOSITORY)
    with np.load(theirs) as there, np.load(ours) as here:
        pairs = [(there[name].astype(np.float64), here[name].astype(np.float64)) for name in here.files]
        assert len(there.files) == len(pairs) >= len(VOICES) * len(WORDS)
    for there_sound, here_sound in pairs:
        assert there_sound.shape == here_sound.shape
        error = float(np.sum((there_sound - here_sound) ** 2))
        assert error <= 10.0 ** (AGREED_DB / 10.0) * float(np.sum(here_sound**2))


def test_the_check_finds_all_but_a_sound_card(pi: Path, settings: str) -> None:
    told = ran(pi, "hvcpd", "--check", "--config", settings, status=os.EX_UNAVAILABLE)
    assert "ok  vocabulary: tasks and names sound different enough" in told
    assert "1 task in" in told


def test_two_robots_agree_by_voice_who_does_a_task_and_drive_it_with_fake_motors(pi: Path, tmp_path: Path) -> None:
    mission = ("--tasks", str(tasks(tmp_path)), "--seed", "2", "--room", "open", "--json")
    here, there = (json.loads(told.splitlines()[-1]) for told in ran_on_both(pi, "simulate", *mission))
    assert there["done"] == {"water the yellow rose": "Bot"}
    assert (there["lost"], there["duplicates"]) == (0, 0)
    wall = {"wall_s", "realtime_factor"}
    assert {key: there[key] for key in there.keys() - wall} == {key: here[key] for key in here.keys() - wall}


def test_a_sealed_sentence_is_encrypted_by_debians_library(pi: Path) -> None:
    program = "from hvcpd.security.cipher import _aead; print(_aead(bytes(16)).encrypt(bytes(13), b'go', None).hex())"
    assert (
        completed(pi, arm64.command(pi, ["-c", program])).strip()
        == AESCCM(bytes(16), tag_length=4).encrypt(bytes(13), b"go", None).hex()
    )


def test_a_robot_comes_up_and_tells_its_status(pi: Path, settings: str, tmp_path: Path) -> None:
    ready = tmp_path / "notify"
    environment = {**arm64.environment(pi), "NOTIFY_SOCKET": str(ready)}
    environment["PYTHONPATH"] += f":{REPOSITORY}"  # for the quiet room; hvcpd is the package's
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notified:
        notified.bind(str(ready))
        notified.settimeout(1.0)
        words = arm64.command(pi, ["-m", "tests.daemon.quiet_robot", "--config", settings])
        robot = subprocess.Popen([*LIMITED, *words], env=environment, cwd=pi)
        try:
            while not is_ready(notified):
                assert robot.poll() is None
            assert "Rob" in ran(pi, "hvcpctl", "status", "--config", settings)
        finally:
            robot.send_signal(signal.SIGKILL)
            robot.wait()
