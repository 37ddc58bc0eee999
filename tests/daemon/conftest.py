"""Rendered units that the tests of a run share, as the starts of one robot do."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def units(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("units")
