"""`hvcpctl config`: every setting in force, and where it comes from."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from contextlib import closing
from typing import Any

from hvcpd.config.settings_file import commented_settings, load_with_sources
from hvcpd.config.sources import Sourced
from hvcpd.control.live.daemon_client import find_daemon
from hvcpd.control.live.short_commands import value_text


def run(options: argparse.Namespace) -> None:
    """Print the settings that a daemon started now would have; with --running or --socket those of the running daemon;
    with --example a settings file to start from."""
    if options.example:
        sys.stdout.write(commented_settings())
        return
    if options.running or options.socket is not None:
        with closing(find_daemon(options)) as daemon:
            settings: list[dict[str, Any]] = daemon.ask("config")["settings"]
    else:
        from hvcpd.synthesis.likeness import name_check

        loaded = load_with_sources(options.config, {"name": options.name}, name_needed=False, reserved=name_check)
        settings = [_as_dict(each) for each in loaded.sources]
    if options.changed:
        settings = [each for each in settings if each["source"] != "default"]
    lines = (json.dumps(each) + "\n" for each in settings) if options.json else _as_text(settings)
    sys.stdout.writelines(lines)


def _as_dict(each: Sourced) -> dict[str, Any]:
    """The setting's fields; the name that stands in for a missing robot's name is shown as none."""
    return {**vars(each), "value": None} if (each.key, each.source) == ("name", "default") else vars(each)


def _as_text(settings: list[dict[str, Any]]) -> Iterable[str]:
    """Three columns; a value stands as YAML has it, so that it can be copied."""
    rows = [(each["key"], value_text(each["value"]), each["source"]) for each in settings]
    first, second = (max((len(row[column]) for row in rows), default=0) for column in (0, 1))
    second = min(second, WIDEST_VALUE)
    return (f"{key:{first}}  {value:{second}}  {source}\n" for key, value, source in rows)


WIDEST_VALUE = 32
"""Characters of the column; a longer value pushes its source to the right."""
