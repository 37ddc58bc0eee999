"""The installer takes the package that fits, or says in one line why none does."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from hvcpd.errors import how_to_install
from release.libraries import REPOSITORY


def installed(
    folder: Path, architecture: str, python: str, kernel: str = "aarch64"
) -> subprocess.CompletedProcess[str]:
    """Run it on a computer whose tools say so, and whose apt-get tells what it was asked."""
    tools = folder / "tools"
    tools.mkdir()
    says = {"dpkg": f"echo {architecture}", "uname": f"echo {kernel}", "apt-get": 'echo "$@"'}
    says["python3"] = f"echo {python}" if python else "exit 127"
    for tool, does in says.items():
        (tools / tool).write_text(f"#!/bin/sh\n{does}\n")
        (tools / tool).chmod(0o755)
    (folder / "install").write_text((REPOSITORY / "release/install").read_text())
    command = ["/bin/sh", str(folder / "install")]
    return subprocess.run(command, env={"PATH": f"{tools}:/usr/bin:/bin"}, capture_output=True, text=True, check=False)


def test_the_newest_that_fits_is_installed(tmp_path: Path) -> None:
    for version in ("0.9.0+py311_arm64", "0.10.0+py311_arm64", "0.11.0+py313_arm64", "0.12.0+py311_amd64"):
        (tmp_path / f"hvcpd_{version}.deb").touch()
    done = installed(tmp_path, "arm64", "3.11")
    assert done.returncode == 0
    assert done.stdout == f"install --yes {tmp_path}/hvcpd_0.10.0+py311_arm64.deb\n"


def test_natural_voices_that_lie_beside_it_are_installed_too(tmp_path: Path) -> None:
    packages = [tmp_path / "hvcpd_0.2.0+py311_arm64.deb", tmp_path / "hvcpd-natural_0.2.0_all.deb"]
    for package in packages:
        package.touch()
    assert installed(tmp_path, "arm64", "3.11").stdout.split()[2:] == [str(package) for package in packages]


@pytest.mark.parametrize(
    ("architecture", "python", "says"),
    [
        ("armhf", "3.11", "this system is armhf (only its kernel, aarch64, has 64); hvcpd needs 64 bits"),
        ("arm64", "3.9", "Python here is 3.9; hvcpd needs 3.11 or newer: write Raspberry Pi OS Lite (64-bit)"),
        ("arm64", "", "Python here is none; hvcpd needs 3.11 or newer"),
        ("arm64", "3.12", "use such a system, or the wheel"),
        ("arm64", "3.13", "no hvcpd_*+py313_arm64.deb here"),
    ],
)
def test_where_none_fits_one_line_says_why(architecture: str, python: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "hvcpd_0.2.0+py311_arm64.deb").touch()
    done = installed(tmp_path, architecture, python)
    assert done.returncode == 1
    assert done.stdout == ""
    assert says in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_hint_is_of_pipx_where_pipx_made_the_environment(tmp_path: Path) -> None:
    """pip would install into another one."""
    (tmp_path / "pipx_metadata.json").touch()
    assert how_to_install("mcap", prefix=str(tmp_path)) == "pipx runpip hvcpd install mcap"
    assert how_to_install("mcap", prefix=str(tmp_path / "venv")) == "pip install mcap"


def test_a_hint_is_of_apt_where_debians_python_runs() -> None:
    inside = "/usr/lib/hvcpd/hvcpd/errors.py"
    assert how_to_install("gpiozero", "python3-gpiozero", inside) == "sudo apt install python3-gpiozero"
    assert how_to_install("gpiozero", "python3-gpiozero", "/home/rob/x/errors.py") == "pip install gpiozero"
    assert "pipx" in how_to_install("matplotlib", None, inside)


def test_on_another_system_the_line_names_the_wheel_as_pipx_takes_it(tmp_path: Path) -> None:
    """pipx takes a name without a slash for one of PyPI's."""
    (tmp_path / "install").write_text((REPOSITORY / "release/install").read_text())
    command = ["/bin/sh", str(tmp_path / "install")]
    tools = tmp_path / "tools"
    tools.mkdir()
    (tools / "dirname").symlink_to("/usr/bin/dirname")
    done = subprocess.run(command, env={"PATH": str(tools)}, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no Debian" in done.stderr
    assert "pipx install ./hvcpd-*.whl" in done.stderr
