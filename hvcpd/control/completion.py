"""`hvcpctl completion bash|zsh|fish`: shell completion, which shtab generates from the parser."""

from __future__ import annotations

import argparse
import sys

import shtab

from hvcpd.control.cli import make_parser


def run(options: argparse.Namespace) -> None:
    """Print the completion for a shell."""
    sys.stdout.write(completion_of(make_parser(), options.shell))


def completion_of(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return the completion of a command for a shell: bash, zsh or fish."""
    _offer_files(parser)
    return f"{shtab.complete(parser, shell)}\n"


def _offer_files(parser: argparse.ArgumentParser) -> None:
    """Mark the arguments of all commands that take a file or a folder, by their metavars, for shtab."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _offer_files(command)
        elif str(action.metavar).startswith(("FILE", "DIR")):
            kind = shtab.FILE if str(action.metavar).startswith("FILE") else shtab.DIRECTORY
            action.complete = kind  # type: ignore[attr-defined]  # how shtab is told
