"""The same examples on every run, on every machine; and which tests `make check` leaves out."""

from __future__ import annotations

import pytest
from hypothesis import settings

settings.register_profile("hvcpd", derandomize=True, database=None, deadline=None, print_blob=True)
settings.load_profile("hvcpd")

SLOW_FILES = frozenset(
    f"test_{name}.py"
    for name in (
        "alternatives bad_input check_vocabulary cli commands conditions drive endurance html life listening live "
        "loudness messages missions stop strangers voice_commands wheel_processes wheels_faults wheels_find "
        "wheels_handshake"
    ).split()
)
"""Files whose tests take seconds together: processes, whole vocabularies, minutes of sound."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.name in SLOW_FILES:
            item.add_marker(pytest.mark.slow)
