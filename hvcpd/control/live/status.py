"""`hvcpctl status` and `hvcpctl tasks`: what a running robot is doing, and its board."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from contextlib import closing
from typing import Any, NoReturn

from hvcpd.control.live.daemon_client import DaemonClient, find_daemon
from hvcpd.control.output import show
from hvcpd.hardware.temperature import processor_temperature_c
from hvcpd.reporting.metrics import metrics_of

EVERY_S = 1.0
"""Interval of `--watch`."""


def run(options: argparse.Namespace, wait: Callable[[float], None] = time.sleep) -> None:
    """Show it once, or with --watch repeatedly until interrupted."""
    with closing(find_daemon(options)) as daemon:
        if options.prometheus:
            sys.stdout.write(metrics_of(daemon.ask("status"), processor_temperature_c()))
            return
        console = None if options.json else _console()
        if options.watch and console is not None and console.is_terminal:
            _watch(daemon, options, wait, console)
        while True:
            result = daemon.ask(options.command)
            if console is None:
                show(True, result)
            else:
                console.print(_screen(options, result))
                sys.stdout.write("\n" * options.watch)
            if not options.watch:
                return
            wait(EVERY_S)


def _watch(daemon: DaemonClient, options: argparse.Namespace, wait: Callable[[float], None], console: Any) -> NoReturn:
    from rich.live import Live

    with Live(console=console, auto_refresh=False) as live:
        while True:
            live.update(_screen(options, daemon.ask(options.command)), refresh=True)
            wait(EVERY_S)


def _screen(options: argparse.Namespace, result: dict[str, Any]) -> Any:
    from hvcpd.control.live.status_screen import status_screen, tasks_screen

    return tasks_screen(result["tasks"]) if options.command == "tasks" else status_screen(result)


def _console() -> Any:
    from hvcpd.control.live.terminal import Terminal

    return Terminal(highlight=False)
