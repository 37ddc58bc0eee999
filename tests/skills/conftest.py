"""A package with skills, for several tests."""

from __future__ import annotations

from pathlib import Path

import pytest

EXAMPLE = Path(__file__).with_name("example_skill.py")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A Python package with a skill, as pip installs one."""
    folder = tmp_path / "site"
    (folder / "example_skill-1.0.dist-info").mkdir(parents=True)
    (folder / "example_skill-1.0.dist-info" / "METADATA").write_text("Name: example-skill\nVersion: 1.0\n")
    points = "[hvcpd.skills]\nwave = example_skill:Wave\nodd = example_skill:Odd\n"
    (folder / "example_skill-1.0.dist-info" / "entry_points.txt").write_text(points)
    (folder / "example_skill.py").write_text(EXAMPLE.read_text())
    monkeypatch.setenv("PYTHONPATH", str(folder))
