"""What only asks a robot starts in a blink: no arithmetic library, no synthesizer, no ears, no check of settings."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hvcpd.control.cli import main
from tests.control.conftest import Ran
from tests.control.obliging import obliging_robot

HEAVY = (
    *("numpy", "cattrs", "concurrent", "rich", "soundfile"),
    *("hvcpd.config.settings", "hvcpd.language.phrasebook", "hvcpd.recognition", "hvcpd.synthesis"),
)

PROGRAM = f"""
import sys
from hvcpd.control.cli import main
status = main(sys.argv[1:])
print(status, [name for name in sys.modules if name.startswith({HEAVY!r})])
"""


@pytest.mark.parametrize(
    "words",
    [
        ("stop",),
        ("status", "--json"),
        ("tasks", "--json"),
        ("task", "again", "3"),
        ("say", "Hi Bot, I am Rob, water the rose"),
        ("say", "Hi Bot, I am Rob, water the rose", "--name", "Rob"),
    ],
)
def test_a_command_that_only_asks_a_robot_loads_nothing_heavy(words: tuple[str, ...], tmp_path: Path) -> None:
    """The check of all settings took half of the time of a stop."""
    command = [sys.executable, "-c", PROGRAM, *words]
    with obliging_robot(tmp_path) as environment:
        environment = {**os.environ, **environment}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.splitlines()[-1] == "0 []"


def test_errors_in_the_settings_are_told_where_no_robot_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "hvcpd.yaml"
    config.write_text(f"mdoe: follow\nname: Rob\ncontrol: {{socket: {tmp_path}/bot.sock}}\n")
    assert main(["stop", "--config", str(config)]) == 3
    assert f"note: the settings have errors ({config}:1: unknown key 'mdoe'" in capsys.readouterr().err
    with obliging_robot(tmp_path) as environment:
        monkeypatch.setenv("XDG_RUNTIME_DIR", environment["XDG_RUNTIME_DIR"])
        config.write_text("mdoe: follow\nname: Rob\nstate_dir: .\n")
        assert main(["stop", "--config", str(config)]) == 0
        assert capsys.readouterr().err == ""
        config.write_text("\t: [")
        assert main(["stop", "--config", str(config), "--socket", str(tmp_path / "rob.sock")]) == 0
        monkeypatch.setenv("HVCPD_STATE_DIR", str(tmp_path))
        assert main(["stop", "--config", str(config)]) == 0
    assert f"note: the settings have errors ({config}:1: not valid YAML" in capsys.readouterr().err


@pytest.mark.parametrize("who", ["I am Rob", "I'm Rob", "I’m Rob", "im rob"])
def test_however_a_speaker_is_written_its_robot_says_the_sentence(
    who: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ran: Ran
) -> None:
    """Of "I'm Rob" this computer made the sound itself, over whoever spoke."""
    config = tmp_path / "bot.yaml"
    config.write_text("name: Bot\nstate_dir: .\n")
    with obliging_robot(tmp_path) as environment:
        monkeypatch.setenv("XDG_RUNTIME_DIR", environment["XDG_RUNTIME_DIR"])
        assert ran("say", f"Hi Bot, {who}, what is left", "--config", config) == "Rob says: x\n"
