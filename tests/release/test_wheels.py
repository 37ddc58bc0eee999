"""Every locked requirement can be had as a wheel for a Raspberry Pi, in a file that the lock knows."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet

from release.lock import Target, needed, read_lock


@pytest.mark.slow
@pytest.mark.parametrize("python", ["3.11", "3.13"])
def test_the_lock_resolves_for_raspberry_pi_os(python: str, tmp_path: Path, index: None) -> None:
    target = Target(python, "arm64")
    wanted = needed(read_lock(), target)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--ignore-installed"]
    pip += ["--dry-run", "--report", str(tmp_path / "report.json"), "--no-deps", "--target", str(tmp_path / "nowhere")]
    versions = [f"{locked.name}=={locked.version}" for locked in wanted]
    done = subprocess.run([*pip, *target.pip_options(), *versions], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "report.json").read_text())["install"]
    files = {
        each["metadata"]["name"].lower(): each["download_info"]["archive_info"]["hashes"]["sha256"] for each in found
    }
    names = {each["metadata"]["name"].lower(): each["download_info"]["url"].rsplit("/")[-1] for each in found}
    known = {locked.name: locked.hashes for locked in wanted}
    assert {name.replace("_", "-") for name in files} == set(known)
    for name, digest in files.items():
        assert digest in known[name.replace("_", "-")], names[name]
        assert names[name].endswith(".whl")
    assert all(python in SpecifierSet(each["metadata"].get("requires_python", "")) for each in found)
    short = python.replace(".", "")
    compiled = [name for name in names.values() if not name.endswith("-none-any.whl")]
    expected = {"numpy", "cffi", "pyyaml", "cryptography", "markupsafe", "soundfile"}
    assert {name.split("-")[0].lower() for name in compiled} == expected
    fits = {name: f"cp{short}" in name or "-abi3-" in name or "py3-none" in name for name in compiled}
    assert all(fits[name] and "aarch64" in name for name in compiled), compiled
