"""A robot with its usual settings, in a folder of its own; a log that others do not notice."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import structlog

from hvcpd.config.settings import Settings
from hvcpd.daemon.wiring import Wiring, wire_up


@pytest.fixture
def wiring(tmp_path: Path) -> Wiring:
    return wire_up(Settings(name="Rob", state_dir=tmp_path / "state"))


@pytest.fixture
def own_log() -> Iterator[None]:
    """The log may be set up as the test needs it."""
    yield
    structlog.reset_defaults()
