"""The commented settings, as they are installed in /etc/hvcpd and printed by `hvcpctl config --example`."""

from __future__ import annotations

from pathlib import Path


def commented_settings() -> str:
    """Return etc/hvcpd.yaml, which the package has beside this module."""
    return Path(__file__).with_name("example.yaml").read_text(encoding="utf-8")
