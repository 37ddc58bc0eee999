"""Shell completion: in a real shell where there is one, and complete in any case."""

from __future__ import annotations

import argparse
import shutil
import subprocess
from pathlib import Path

import pytest

from hvcpd.control.cli import make_parser
from tests.control.conftest import Ran


def script(shell: str, ran: Ran) -> str:
    return ran("completion", shell)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_command_is_there(shell: str, ran: Ran) -> None:
    text = script(shell, ran)
    [commands] = [a for a in make_parser()._actions if isinstance(a, argparse._SubParsersAction)]
    listed = list(commands.choices)
    assert len(listed) > 20
    assert [name for name in listed if name not in text] == []


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash here")
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("hvcpctl sta", ["status"]),
        ("hvcpctl status --wa", ["--watch"]),
        ("hvcpctl simulate --mode ", ["volunteer", "coordinate"]),
        ("hvcpctl completion ", ["bash", "zsh", "fish"]),
        ("hvcpctl drive g", ["goto"]),
        ("hvcpctl drive goto --ba", ["--back"]),
        ("hvcpctl hear rec", ["recordings", "record.wav"]),
        ("hvcpctl hear --plot rec", ["recordings", "record.wav"]),
        ("hvcpctl simulate --report rec", ["recordings"]),
    ],
)
def test_in_bash(line: str, expected: list[str], tmp_path: Path, ran: Ran) -> None:
    (tmp_path / "record.wav").touch()
    (tmp_path / "recordings").mkdir()
    words = line.split(" ")
    array = " ".join(f"'{word}'" for word in words)
    test = f'\nCOMP_WORDS=({array}); COMP_CWORD={len(words) - 1}; _shtab_hvcpctl; printf "%s\\n" "${{COMPREPLY[@]}}"'
    command = ["bash", "-c", script("bash", ran) + test]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=30, check=True)
    assert done.stderr == ""
    assert sorted(done.stdout.split()) == sorted(expected)


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_can_read_theirs(shell: str, ran: Ran) -> None:
    program = shutil.which(shell)
    if program is None:
        pytest.skip(f"there is no {shell} here")
    subprocess.run([program, "-n"], input=script(shell, ran), text=True, timeout=30, check=True)
