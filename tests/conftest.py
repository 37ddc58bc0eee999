"""The same examples on every run, on every machine; a failure here is a failure everywhere."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("hvcpd", derandomize=True, database=None, deadline=None, print_blob=True)
settings.load_profile("hvcpd")


@pytest.fixture(scope="session")
def units(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Rendered units that the tests of a run share, as the starts of one robot do."""
    return tmp_path_factory.mktemp("units")
