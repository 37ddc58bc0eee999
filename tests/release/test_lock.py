"""The lock file is read as pip reads it, and what is made of it holds what it holds."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from hvcpd import __version__
from release.deb import this_computer
from release.libraries import write_bill_of_materials
from release.lock import LOCK, LockError, Target, needed, read_lock

PI = [Target("3.11", "arm64"), Target("3.13", "arm64")]


def test_every_hash_of_the_lock_is_read() -> None:
    text = LOCK.read_text()
    assert sorted(digest for locked in read_lock() for digest in locked.hashes) == sorted(
        re.findall(r"sha256:(\S+)", text)
    )
    assert [f"{locked.name}=={locked.version}" for locked in read_lock()] == re.findall(r"^(\S+==\S+)", text, re.M)


@pytest.mark.parametrize(
    "line",
    [
        "numpy>=2 --hash=sha256:" + "0" * 64,
        "numpy==2.4",
        "numpy==2.4 --hash=sha256:" + "0" * 63,
        "numpy==2.4 --hash=sha256:" + "0" * 64 + " --hash=md5:" + "0" * 32,
        "-r other.txt",
    ],
)
def test_what_is_not_pinned_to_a_version_and_a_hash_is_refused(tmp_path: Path, line: str) -> None:
    path = tmp_path / "run.txt"
    path.write_text(f"# a comment\n{line}\n")
    with pytest.raises(LockError, match="make lock"):
        read_lock(path)


def test_a_computer_that_no_package_is_made_for_is_refused() -> None:
    with pytest.raises(LockError, match=r"3\.11 or 3\.13"):
        Target("3.12", "arm64")
    with pytest.raises(LockError, match="amd64 or arm64"):
        Target("3.11", "armhf")
    assert this_computer().architecture in ("amd64", "arm64")


@pytest.mark.parametrize("target", PI, ids=str)
def test_each_computer_needs_every_package_in_one_version(target: Target) -> None:
    names = [locked.name for locked in needed(read_lock(), target)]
    assert sorted(names) == sorted({locked.name for locked in read_lock()})


def test_the_versions_of_one_package_are_told_apart_by_python() -> None:
    old, new = ({locked.name: locked.version for locked in needed(read_lock(), target)} for target in PI)
    twice = {locked.name for locked in read_lock() if [each.name for each in read_lock()].count(locked.name) > 1}
    assert twice
    assert {name for name in old if old[name] != new[name]} == twice


def test_the_bill_of_materials_lists_what_the_package_holds(tmp_path: Path) -> None:
    wanted = needed(read_lock(), PI[1])
    write_bill_of_materials(wanted, tmp_path / "bill.json")
    bill = json.loads((tmp_path / "bill.json").read_text())
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    assert (bill["metadata"]["component"]["name"], bill["metadata"]["component"]["version"]) == ("hvcpd", __version__)
    listed = {
        each["purl"]: sorted(one["content"] for one in each["externalReferences"][0]["hashes"])
        for each in bill["components"]
    }
    assert listed == {f"pkg:pypi/{each.name}@{each.version}": sorted(each.hashes) for each in wanted}
