"""Folders that the environment names."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path


def xdg_folder(variable: str, environment: Mapping[str, str] = os.environ) -> Path | None:
    """The folder that a variable of the XDG Base Directory Specification (0.8) names. None without one, and for a
    relative path, which by the specification is to be ignored."""
    folder = Path(environment.get(variable, ""))
    return folder if folder.is_absolute() else None
