"""Shell completion: in a real shell where there is one, and whole in any case."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from hvcpd.control.cli import main, make_parser
from hvcpd.control.completion import tree


def script(shell: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["completion", shell]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_command_and_option_is_there(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = script(shell, capsys)
    nodes = list(tree(make_parser()))
    assert {"status", "say", "drive", "completion"} <= {node.path[0] for node in nodes if node.path}
    for node in nodes:
        assert all(word in text for word in node.path)
        for option in node.options:
            assert all(name.lstrip("-") in text for name in option.names)


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
        ("hvcpctl status --name --js", []),
        ("hvcpctl hear ", []),
    ],
)
def test_in_bash(line: str, expected: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    words = line.split(" ")
    array = " ".join(f"'{word}'" for word in words)
    test = f'\nCOMP_WORDS=({array}); COMP_CWORD={len(words) - 1}; _hvcpctl; printf "%s\\n" "${{COMPREPLY[@]}}"'
    done = subprocess.run(
        ["bash", "-c", script("bash", capsys) + test], capture_output=True, text=True, timeout=30, check=True
    )
    assert done.stderr == ""
    assert done.stdout.split() == expected


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_can_read_theirs(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    program = shutil.which(shell)
    if program is None:
        pytest.skip(f"there is no {shell} here")
    subprocess.run([program, "-n"], input=script(shell, capsys), text=True, timeout=30, check=True)
