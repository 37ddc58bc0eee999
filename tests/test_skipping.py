"""What `make test` says of skipped tests."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.skipping import summary

ROOT = Path(__file__).parent.parent


def test_what_make_parts_mends_is_one_line() -> None:
    reasons = ["Skipped: not installed: pulseaudio (`make parts` installs them as root)", "not installed (make parts)"]
    assert list(summary(reasons)) == ["2 tests of real parts skipped; for them: make parts"]


def test_other_reasons_are_listed_with_their_number() -> None:
    reasons = ["Skipped: no robot", "Skipped: no robot", "Skipped: not root"]
    assert list(summary(reasons)) == ["3 tests skipped for other reasons: no robot (2); not root (1)"]


def test_nothing_is_said_of_nothing() -> None:
    assert list(summary([])) == []


@pytest.mark.slow
@pytest.mark.parametrize("workers", [(), ("-n", "2")])
def test_pytest_says_so_at_the_end(tmp_path: Path, workers: tuple[str, ...]) -> None:
    (tmp_path / "conftest.py").write_text("from tests.conftest import pytest_terminal_summary\n")
    (tmp_path / "test_it.py").write_text(
        "import pytest\n\n\n@pytest.mark.parametrize('n', range(3))\ndef test_it(n): pytest.skip('make parts')\n"
    )
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(tmp_path), *workers]
    done = subprocess.run([*command, str(tmp_path)], capture_output=True, text=True, cwd=ROOT, timeout=300)
    assert "3 tests of real parts skipped; for them: make parts" in done.stdout.splitlines(), done.stdout


def test_only_make_parts_touches_the_system() -> None:
    for name in ("Makefile", ".ci/make-venv", ".ci/fetch-pip.py"):
        lines = (ROOT / name).read_text().splitlines()
        assert not [line for line in lines if "apt-get" in line], name
    makefile = (ROOT / "Makefile").read_text()
    assert makefile.count("install-parts") == 1
