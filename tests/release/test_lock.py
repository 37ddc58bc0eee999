"""The lock file is read as pip reads it, and what is made of it holds what it holds."""

from __future__ import annotations

import json
import re
import uuid
from pathlib import Path

import pytest

from hvcpd import __version__
from release.deb import this_computer
from release.lock import LOCK, LockError, Target, needed, read_lock
from release.sbom import bill_of_materials, main

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


def test_the_bill_of_materials_lists_the_lock_and_nothing_else(tmp_path: Path) -> None:
    assert main([str(tmp_path / "new" / "bill.json")]) == 0
    bill = json.loads((tmp_path / "new" / "bill.json").read_text())
    assert (bill["bomFormat"], bill["specVersion"], bill["version"]) == ("CycloneDX", "1.6", 1)
    assert bill["metadata"]["component"]["purl"] == f"pkg:pypi/hvcpd@{__version__}"
    listed = {
        (each["name"], each["version"]): [one["content"] for one in each["hashes"]] for each in bill["components"]
    }
    assert listed == {(locked.name, locked.version): list(locked.hashes) for locked in read_lock()}
    references = [component["bom-ref"] for component in bill["components"]]
    assert len(set(references)) == len(references)
    assert bill["dependencies"] == [{"ref": bill["metadata"]["component"]["bom-ref"], "dependsOn": references}]


def test_the_serial_number_follows_from_the_contents() -> None:
    lock = read_lock()
    one, same, other = bill_of_materials(lock), bill_of_materials(lock[::-1]), bill_of_materials(lock[1:])
    assert one == same
    assert one["serialNumber"] != other["serialNumber"]
    assert uuid.UUID(one["serialNumber"].removeprefix("urn:uuid:")).version == 5
