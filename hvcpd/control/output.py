"""What commands print: results for people or for programs, and notes beside them."""

from __future__ import annotations

import json
import sys

from hvcpd.config.command_line import print_error


def show(as_json: bool, result: object, *lines: str) -> None:
    """Print a result: in one line of JSON for programs, or in lines for people."""
    sys.stdout.writelines(f"{line}\n" for line in ([json.dumps(result)] if as_json else lines))


def print_note(text: str) -> None:
    """Write a line to standard error; a command goes on where that cannot be written."""
    print_error("hvcpctl", text)
