"""The wheel and the source archive, whole: with manual pages, units and settings, and the wheel with rendered words.

python -m release.wheel [--output dist]

Made in a copy of the source files, so that nothing that was built comes into the working copy. It works in an unpacked
source archive as well.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from release.libraries import REPOSITORY, SHIPPED
from release.manuals import put_manuals
from release.words import default_words, write_words

_BUILD = "import setuptools.build_meta as backend, sys; backend.{0}(sys.argv[1])"


def build(output: Path) -> tuple[Path, Path]:
    """Make the wheel and the source archive in `output`; their paths. Raises OSError or CalledProcessError."""
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="hvcpd-wheel-") as scratch:
        tree, made = Path(scratch) / "tree", Path(scratch) / "made"
        archive = build_archive(tree, made)  # before there are words, which a robot without them renders itself
        write_words(default_words(), tree / SHIPPED)
        _run("build_wheel", tree, made)
        wheel = next(made.glob("*.whl"))
        return Path(shutil.copy(wheel, output)), Path(shutil.copy(archive, output))


def source_files() -> list[str]:
    """The files that hvcpd is made of, by their paths in the working copy: those that git does not ignore, or those
    that came with an unpacked source archive."""
    if (REPOSITORY / ".git").exists():
        command = ["git", "-C", str(REPOSITORY), "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        listed = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split("\0")
    else:
        listed = (REPOSITORY / "hvcpd.egg-info/SOURCES.txt").read_text().splitlines()
    return [name for name in listed if name and (REPOSITORY / name).is_file()]


def build_archive(tree: Path, output: Path) -> Path:
    """Copy the source files to `tree` and make the source archive of it in `output`; its path."""
    for name in source_files():
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(REPOSITORY / name, tree / name)
    put_manuals(tree / "man")
    output.mkdir(parents=True, exist_ok=True)
    _run("build_sdist", tree, output)
    return next(output.glob("*.tar.gz"))


def _run(what: str, tree: Path, output: Path) -> None:
    command = [sys.executable, "-c", _BUILD.format(what), str(output)]
    subprocess.run(command, cwd=tree, check=True, stdout=subprocess.DEVNULL)


def main(arguments: Sequence[str]) -> int:
    """Build both; returns the exit status."""
    parser = argparse.ArgumentParser(prog="release.wheel", description="Build the wheel and the source archive.")
    parser.add_argument("--output", type=Path, default=Path("dist"), metavar="DIR", help="default: dist")
    for path in build(parser.parse_args(arguments).output):
        sys.stdout.write(f"{path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
