"""Manual pages and completions name every command, option and setting, and man finds no fault in them."""

from __future__ import annotations

import gzip
import shutil
import subprocess
from dataclasses import fields
from pathlib import Path
from types import ModuleType

import pytest

from hvcpd.config.settings import Settings
from hvcpd.config.settings_file import commented_settings
from hvcpd.control.cli import main, make_parser
from release import acoustic_net, animation, manuals, words
from release.deb import SHELLS, debian_changelog, put_completions
from release.manuals import command_page, put_manuals, settings_page


def test_the_page_of_hvcpctl_has_every_command_and_option() -> None:
    page = command_page(make_parser(), "hvcpd(1)").replace("\\-", "-")
    commands = next(action.choices for action in make_parser()._actions if isinstance(action.choices, dict))
    heads = {line.removeprefix(".SS ") for line in page.splitlines() if line.startswith(".SS ")}
    assert heads >= {*commands, "drive forward"}
    for command in commands.values():
        options = {option for action in command._actions for option in action.option_strings} - {"-h", "--help"}
        assert all(option in page for option in options)


def test_the_page_of_the_settings_has_every_setting_under_its_text() -> None:
    page = settings_page(commented_settings())
    heads = {key for line in page.splitlines() if line.startswith(".SS ") for key in line[4:].split(", ")}
    assert {field.name for field in fields(Settings)} <= heads


@pytest.mark.parametrize("tool", [acoustic_net, animation, manuals, words])
def test_help_is_no_folder(tool: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        tool.main(["--help"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(shutil.which("man") is None, reason="man is not here: apt install man-db")
def test_man_finds_no_fault_in_the_pages(tmp_path: Path) -> None:
    put_manuals(tmp_path)
    pages = sorted(tmp_path.rglob("*.gz"))
    assert [page.name for page in pages] == ["hvcpctl.1.gz", "hvcpd.1.gz", "hvcpd.yaml.5.gz"]
    for page in pages:
        plain = tmp_path / page.stem
        plain.write_bytes(gzip.decompress(page.read_bytes()))
        done = subprocess.run(
            ["man", "--warnings", "--encoding=UTF-8", "--local-file", plain],
            capture_output=True,
            text=True,
            env={"PATH": "/usr/bin:/bin", "MANROFFSEQ": "", "MANWIDTH": "80", "LC_ALL": "C.UTF-8"},
        )
        assert done.stderr == ""
        assert "hvcpd" in done.stdout


def test_each_shell_completes_both_commands(tmp_path: Path) -> None:
    put_completions(tmp_path)
    for place in SHELLS.values():
        assert "--check" in (tmp_path / place.format(command="hvcpd")).read_text().replace("-l check", "--check")
        assert "prerender" in (tmp_path / place.format(command="hvcpctl")).read_text()


@pytest.mark.skipif(shutil.which("dpkg-parsechangelog") is None, reason="dpkg-dev is not here: apt install dpkg-dev")
def test_debians_tools_read_the_changelog(tmp_path: Path) -> None:
    (tmp_path / "changelog").write_text(debian_changelog("0.2.0+py311", "A B <a@b.example>", 0.0))
    command = ["dpkg-parsechangelog", "--file", str(tmp_path / "changelog"), "--show-field", "Version"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "0.2.0+py311\n"


def test_the_example_is_the_installed_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["config", "--example"]) == 0
    assert capsys.readouterr().out == Path("etc/hvcpd.yaml").read_text(encoding="utf-8")
