"""`make test-arm64` where something that it needs is missing."""

from __future__ import annotations

from pathlib import Path

import pytest

from release.arm64 import NEEDED, UnavailableError, make_root


@pytest.mark.parametrize("missing", NEEDED)
def test_a_missing_program_is_told_by_its_package(
    missing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs = tmp_path / "bin"
    programs.mkdir()
    for program in NEEDED.keys() - {missing}:
        (programs / program).touch(mode=0o755)
    monkeypatch.setenv("PATH", str(programs))

    with pytest.raises(UnavailableError, match=f"apt install {NEEDED[missing]}$"):
        make_root(tmp_path / "root")
