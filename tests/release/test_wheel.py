"""The source archive is whole: who unpacks it can do all that the Makefile offers, and install it as the wheel."""

from __future__ import annotations

import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from release.libraries import REPOSITORY
from release.wheel import build_archive, source_files

OF_THE_REPOSITORY = (".github", ".gitignore", ".pre-commit-config.yaml")
"""Only a clone has a use for them."""
MANUALS = {"man/man1/hvcpd.1.gz", "man/man1/hvcpctl.1.gz", "man/man5/hvcpd.yaml.5.gz"}


@pytest.mark.skipif(not (REPOSITORY / ".git").exists(), reason="only a clone knows which files are its own")
def test_the_source_archive_has_every_file_that_is_not_for_a_clone_alone(tmp_path: Path) -> None:
    with tarfile.open(build_archive(tmp_path / "tree", tmp_path / "made")) as archive:
        archive.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    packed = {str(path.relative_to(unpacked)) for path in unpacked.rglob("*") if path.is_file()}
    wanted = {name for name in source_files() if not name.startswith(OF_THE_REPOSITORY)}
    assert wanted - packed == set()
    assert packed >= MANUALS, "pip builds from it without our tools"
    command = "import release.wheel as own; print(*own.source_files(), sep='\\n')"
    known = subprocess.run([sys.executable, "-c", command], cwd=unpacked, check=True, capture_output=True, text=True)
    assert set(known.stdout.splitlines()) >= wanted, "`make wheel` works there without git"
