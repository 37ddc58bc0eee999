"""Examples at the end of a command's help, for commands that bring none of their own."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from hvcpd.config.command_line import Skipped, with_examples

EXAMPLES: dict[str, tuple[str, ...]] = {
    "simulate": ("hvcpctl simulate --seed 2 --robots Rob,Bot,Ada", "hvcpctl simulate --noise-db 60 --report out/noisy"),
    "hear": ("hvcpctl hear yellow.wav", "hvcpctl hear yellow.wav --json"),
    "listen": ("hvcpctl listen", "hvcpctl listen --names Rob,Bot"),
    "phrases": ("hvcpctl phrases --tasks tasks.yaml", "hvcpctl phrases --format html > card.html"),
    "playground": ("hvcpctl playground",),
    "pronounce": ("hvcpctl pronounce geranium",),
    "prerender": ("hvcpctl prerender --names Rob,Bot",),
    "check-vocabulary": ("hvcpctl check-vocabulary --tasks tasks.yaml --names Rob,Bot",),
    "transcript": ("hvcpctl transcript", "hvcpctl transcript --since 1h"),
    "report": ("hvcpctl report --since 8h --html shift.html",),
    "audit": ("hvcpctl audit --since 8h",),
    "tasks": ("hvcpctl tasks", "hvcpctl tasks --json"),
    "resume": ("hvcpctl resume",),
    "reload": ("hvcpctl reload",),
    "config": ("hvcpctl config", "hvcpctl config --example > hvcpd.yaml"),
    "key": ("hvcpctl key new", "hvcpctl key sheet"),
    "key new": ("hvcpctl key new",),
    "key show": ("hvcpctl key show",),
    "key sheet": ("hvcpctl key sheet",),
    "key rotate": ("hvcpctl key rotate",),
    "key revoke": ("hvcpctl key revoke Anna",),
    "key restore": ("hvcpctl key restore",),
    "drive": ("hvcpctl drive status", "hvcpctl drive forward 0.2 --dry-run"),
    "drive status": ("hvcpctl drive status --json",),
    "drive forward": ("hvcpctl drive forward 0.2", "hvcpctl drive forward -0.2"),
    "drive turn": ("hvcpctl drive turn 90",),
    "drive goto": ("hvcpctl drive goto 1 0.5 --back",),
    "drive stop": ("hvcpctl drive stop",),
    "drive calibrate": ("hvcpctl drive calibrate",),
    "doctor": ("hvcpctl doctor",),
    "calibrate": ("hvcpctl calibrate",),
    "bench": ("hvcpctl bench",),
    "stop-test": ("hvcpctl stop-test",),
    "evaluate": ("hvcpctl evaluate wake",),
}
"""By command, with its action where it has any; each is a line that can be copied into a shell."""


def all_parsers(parser: argparse.ArgumentParser, path: str = "") -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Every command and action below `parser`, by what is typed after `hvcpctl`."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, command in action.choices.items():
                if isinstance(command, Skipped):
                    continue
                here = f"{path} {name}".strip()
                yield here, command
                yield from all_parsers(command, here)


def add_examples(parser: argparse.ArgumentParser) -> None:
    """Append the examples to each command's help, and open it with the line that lists the command."""
    for path, command in all_parsers(parser):
        if command.description is None and (line := _listed_as(parser, path)):
            command.description = f"{line[0].upper()}{line[1:]}."
        if path in EXAMPLES:
            command.epilog = with_examples(command.epilog or "", *EXAMPLES[path])


def _listed_as(parser: argparse.ArgumentParser, path: str) -> str | None:
    """The help that is shown beside the command in the list of its siblings."""
    above, _, name = path.rpartition(" ")
    parent = dict(all_parsers(parser))[above] if above else parser
    for action in parent._actions:
        if isinstance(action, argparse._SubParsersAction):
            return next((each.help for each in action._choices_actions if each.dest == name), None)
    return None
