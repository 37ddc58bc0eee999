"""A Debian and a package of hvcpd, which the tests of a run share whatever process they are in."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from release.deb import AT_ONCE, build, this_computer
from release.libraries import STRIP
from release.lock import Target, read_lock
from tests.release.container import PYTHON, base_root, locked, skip_unless_possible


@pytest.fixture(scope="session")
def debian(request: pytest.FixtureRequest) -> Path:
    skip_unless_possible()
    assert request.config.cache is not None
    return base_root(request.config.cache.mkdir("debian-root"))


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory, worker_id: str, index: None) -> Path:
    """The Debian package for Debian 12 on this kind of processor."""
    skip_unless_possible()
    strip = STRIP[this_computer().architecture]
    if shutil.which(strip) is None:
        pytest.skip(f"{strip} is missing: apt install binutils")
    own = tmp_path_factory.getbasetemp()
    shared = own if worker_id == "master" else own.parent
    with locked(shared / "deb.lock"):
        there = list((shared / "deb").glob("*.deb"))
        target = Target(PYTHON, this_computer().architecture)
        return there[0] if there else build(target, shared / "deb", compression=AT_ONCE)


@pytest.fixture(scope="session")
def index(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The package index answers, or the test is skipped."""
    smallest = next(locked for locked in read_lock() if locked.name == "mdurl")
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--retries", "1", "--no-cache-dir"]
    target = ["--dest", str(tmp_path_factory.mktemp("index")), f"{smallest.name}=={smallest.version}"]
    done = subprocess.run([*pip, *target], capture_output=True, text=True, timeout=120)
    if done.returncode != 0:
        pytest.skip(f"the package index cannot be reached: {done.stderr[-200:]}")


def renamed(package: Path, version: str, folder: Path) -> Path:
    """The same package as a later version."""
    tree = folder / "tree"
    subprocess.run(["dpkg-deb", "--raw-extract", package, tree], check=True)
    control = tree / "DEBIAN" / "control"
    lines = control.read_text().splitlines()
    control.write_text(
        "\n".join(f"Version: {version}" if line.startswith("Version:") else line for line in lines) + "\n"
    )
    later = folder / f"hvcpd_{version}.deb"
    subprocess.run(["dpkg-deb", "--root-owner-group", "-Zzstd", "-z1", "--build", tree, later], check=True)
    return later
