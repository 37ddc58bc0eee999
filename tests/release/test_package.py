"""The Debian package, built and then installed, upgraded, removed and purged in a Debian of its own."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hvcpd import __version__
from hvcpd.synthesis import acoustic_net
from release.deb import AT_ONCE, FILES, LIBRARIES, TEMPLATES, build_natural
from release.libraries import REPOSITORY, SHIPPED, WEIGHTS
from tests.release.conftest import renamed
from tests.release.container import Container

pytestmark = pytest.mark.slow

OWN_LINE = "# what somebody wrote into the settings\n"


def listed(*command: str | Path) -> list[str]:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()


def test_its_contents_are_roots_and_where_debian_wants_them(package: Path) -> None:
    contents = listed("dpkg-deb", "--contents", package)
    modes = {line.split()[5].removeprefix("."): line.split()[0] for line in contents if " -> " not in line}
    assert {line.split()[1] for line in contents} == {"root/root"}
    assert {modes["/usr/bin/hvcpd"], modes["/usr/bin/hvcpctl"]} == {"-rwxr-xr-x"}
    packed = {path for path in FILES.values() if not path.endswith("CHANGELOG.md")}
    assert {f"/{path}" for path in (*packed, "usr/share/man/man5/hvcpd.yaml.5.gz")} <= set(modes)
    assert f"/usr/lib/hvcpd/{SHIPPED}/index.json" in modes
    unwanted = ("__pycache__", "/tests/", "/bin/f2py", ".dist-info/RECORD")
    assert not [path for path in modes if any(part in path for part in unwanted)]
    assert all(mode[5] == mode[8] == "-" for mode in modes.values()), "nothing is writable for others"
    assert f"/{LIBRARIES / WEIGHTS}" not in modes, "they are a package of their own"
    assert [line.split()[-1] for line in contents if " -> " in line] == [
        f"../../{platform.machine()}-linux-gnu/libsndfile.so.1"
    ]
    conffiles = listed("dpkg-deb", "--info", package, "conffiles")
    assert conffiles == [path for path in modes if path.startswith("/etc/") and not path.endswith("/")]


def test_natural_voices_are_a_package_for_any_computer(tmp_path: Path) -> None:
    natural = build_natural(tmp_path, compression=AT_ONCE)
    assert natural.name == f"hvcpd-natural_{__version__}_all.deb"
    unpacked = tmp_path / "root"
    subprocess.run(["dpkg-deb", "--extract", natural, unpacked], check=True)
    assert (unpacked / LIBRARIES / WEIGHTS).read_bytes() == acoustic_net.WEIGHTS.read_bytes()
    assert (unpacked / "usr/share/doc/hvcpd-natural/copyright").exists()


def test_a_robot_that_does_not_come_up_again_does_not_fail_an_upgrade(tmp_path: Path) -> None:
    running, tools = tmp_path / "run/systemd/system", tmp_path / "tools"
    for folder in (running, tools):
        folder.mkdir(parents=True)
    for tool in ("systemd-sysusers", "systemd-tmpfiles", "python3", "udevadm", "systemctl"):
        (tools / tool).write_text('#!/bin/sh\ncase "$*" in *restart*) echo "$*"; exit 1;; esac\n')
        (tools / tool).chmod(0o755)
    script = (TEMPLATES / "postinst").read_text().replace("/run/systemd/system", str(running))
    done = subprocess.run(
        ["/bin/sh", "-c", script, "postinst", "configure", "0.1.0"],
        env={"PATH": str(tools)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "try-restart hvcpd.service" in done.stdout
    assert done.returncode == 0
    assert "--no-block" in done.stdout, "making its words takes a robot minutes"


def test_removal_disables_each_unit_and_a_purge_forgets_each_ones_folder() -> None:
    """The skills' service was left enabled, a link to nothing, and its folder stayed."""
    prerm, postrm = ((TEMPLATES / script).read_text() for script in ("prerm", "postrm"))
    units = {source: (REPOSITORY / source).read_text() for source, to in FILES.items() if "systemd/system/" in to}
    assert len(units) == 3
    for source, unit in units.items():
        assert Path(source).name.replace("@", "@*") in prerm
        assert set(re.findall(r"^StateDirectory=(\S+)", unit, re.MULTILINE)) <= set(
            re.findall(r"/var/lib/(\S+)", postrm)
        )


def test_docstrings_of_what_the_daemon_loads_are_not_compiled_nor_what_only_simulations_load(tmp_path: Path) -> None:
    for folder in ("numpy", "rich", "hvcpd/evaluation", "hil_fakes"):
        (tmp_path / folder).mkdir(parents=True)
    kept = ("numpy/__init__.py", "rich/__init__.py", "hvcpd/__init__.py")
    for name in (*kept, "hvcpd/evaluation/wake.py", "hil_fakes/room.py"):
        (tmp_path / name).write_text('"""What it is."""\n')
    subprocess.run([sys.executable, TEMPLATES / "compile.py", tmp_path], check=True)
    compiled = [path.relative_to(tmp_path).parts[0] for path in tmp_path.rglob("*.pyc")]
    assert sorted(compiled) == ["hvcpd", "numpy", "rich"]
    program = "import numpy, hvcpd, rich; print(numpy.__doc__, hvcpd.__doc__, rich.__doc__)"
    assert listed(sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {program}") == [
        "None None What it is."
    ]


def test_the_pages_that_units_name_are_in_the_package() -> None:
    units = "".join(path.read_text() for path in (REPOSITORY / "systemd").glob("*.service"))
    assert set(re.findall(r"file:///(\S+)", units)) <= set(FILES.values())


@pytest.mark.container
def test_from_installation_to_purge(debian: Path, package: Path, tmp_path: Path) -> None:
    later = renamed(package, "99.0", tmp_path)
    with Container(debian, tmp_path) as robot:
        for number, file in enumerate((package, later)):
            shutil.copyfile(file, robot.root / f"root/{number}.deb")
        robot.run("dpkg", "--install", "/root/0.deb")
        check_installation(robot)

        settings, memory = robot.root / "etc/hvcpd/hvcpd.yaml", robot.root / "var/lib/hvcpd/rob.sqlite3"
        settings.write_text(settings.read_text() + OWN_LINE)
        memory.write_text("what the robot remembers")
        robot.run("dpkg", "--install", "/root/1.deb")
        assert robot.run("dpkg-query", "--show", "--showformat=${Version} ${db:Status-Abbrev}", "hvcpd") == "99.0 ii"
        assert OWN_LINE in settings.read_text(), "dpkg did not ask, as nobody else changed it"
        assert memory.read_text() == "what the robot remembers"

        robot.run("systemctl", "enable", "hvcpd", "hvcpd-skills")
        robot.run("dpkg", "--remove", "hvcpd")
        assert not (robot.root / "usr/lib/hvcpd").exists(), "compiled files go too"
        assert not (robot.root / "usr/bin/hvcpd").exists()
        assert not list((robot.root / "etc/systemd/system").rglob("hvcpd*")), "no link to a unit that is gone"
        assert OWN_LINE in settings.read_text()
        assert memory.exists()

        robot.run("dpkg", "--purge", "hvcpd")
        assert not settings.parent.exists()
        assert not memory.parent.exists()


def check_installation(robot: Container) -> None:
    assert "hvcpd" in robot.run("id", "hvcpd")
    groups = robot.run("id", "-nG", "hvcpd").split()
    assert sorted(groups) == ["audio", "dialout", "gpio", "hvcpd"]
    assert robot.run("stat", "--format=%U:%G %a", "/var/lib/hvcpd") == "hvcpd:hvcpd 750"
    assert not list((robot.root / "etc/systemd/system").rglob("hvcpd*")), "a robot starts when its name is set"
    assert robot.run("hvcpd", "--version") == f"hvcpd {__version__}"
    assert "Hi Rob, I am Bot" in robot.run("hvcpctl", "hear", spoken(robot))
    compiled = robot.root / "usr/lib/hvcpd/numpy/__pycache__"
    assert list(compiled.glob("*.pyc")), "else every start compiles anew, as the service may not write there"


def spoken(robot: Container) -> str:
    """A recording that the installed commands made: numpy, the phrasebook and the synthesizer are whole."""
    robot.run("hvcpctl", "say", "Hi Rob, I am Bot, water the yellow rose", "-o", "/root/yellow.wav")
    return "/root/yellow.wav"
