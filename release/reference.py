"""Writes docs/reference from the code: `python -m release.reference [--check]`.

Commands come from the parsers, settings from their dataclasses and etc/hvcpd.yaml, sentences from the forms, events
from their dataclasses, and modules from their docstrings.
"""

from __future__ import annotations

import argparse
import ast
import dataclasses
import re
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from types import UnionType
from typing import Literal, Union, get_args, get_origin

from hvcpd import cli as daemon_cli
from hvcpd.config.settings import Settings
from hvcpd.config.sources import leaf_keys, variable_of
from hvcpd.control import cli as control_cli
from hvcpd.daemon.control_events import FREQUENT, KINDS
from hvcpd.language.forms import FORMS, OPENING

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "reference"
MADE = "<!-- Written by python -m release.reference; do not edit. -->\n\n"
PACKAGES = ("hil_fakes", "hvcpd/language", "hvcpd/recognition", "hvcpd/synthesis")

EXIT_STATUS = """\
## Exit status

| Status | `hvcpctl` | `hvcpd` |
|---|---|---|
| 0 | success | stopped by a signal |
| 1 | a mission, motion or request did not end well | |
| 2 | bad input (an option, a file, a sentence), or a device is missing | |
| 3 | no daemon runs | |
| 4 | no permission to ask the daemon | |
| 64 | | wrong usage |
| 69 | | a device is missing or failed, or this robot runs already |
| 70 | | a bug in hvcpd |
| 73 | | the memory's folder cannot be written |
| 78 | | an error in the settings or tasks, or a memory of a newer version |
| 130 | interrupted | interrupted before it began |

## JSON

Commands that print results for people have `--json`: one object a line. These have none, for a reason:

- `console`, `mcap`, `mqtt`, `playground` and `ros` print nothing but an address or a file name.
- `duet` is used by hand. Programs use the [control socket](../control.md).
- `new-team` asks questions and writes files.
- `skills` prints what it carries out. The control socket has the same as events.
- `evaluate` writes CSV files.
- `key` prints secrets for people to copy by hand.
- `completion` prints what a shell reads.

"""


def commands() -> str:
    """All commands with their options."""
    text = f"{MADE}# Commands\n\n[What they print](../commands.md) shows them at work.\n\n{EXIT_STATUS}## hvcpctl\n\n"
    parts = [text, *_described(control_cli.make_parser(), 3), "## hvcpd\n\n", _options(daemon_cli.make_parser())]
    return "".join(parts)


def _described(parser: argparse.ArgumentParser, level: int) -> Iterator[str]:
    for name, command, text in _subcommands(parser):
        yield f"{'#' * level} {parser.prog} {name}\n\n{_sentence(text)}\n\n"
        yield _options(command)
        yield from _described(command, level + 1)


def _subcommands(parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser, str]]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            helps = {str(choice.dest): str(choice.help or "") for choice in action._choices_actions}
            for name, command in action.choices.items():
                yield name, command, helps.get(name, "")


def _options(parser: argparse.ArgumentParser) -> str:
    rows = []
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction | argparse._HelpAction):
            continue
        value = action.metavar or ("{" + ",".join(map(str, action.choices)) + "}" if action.choices else "")
        shown = f" {value}" if value and action.nargs != 0 and action.option_strings else ""
        name = f"{', '.join(action.option_strings)}{shown}" if action.option_strings else str(value or action.dest)
        text = (action.help or "") % {**vars(action), "prog": parser.prog} if action.help else ""
        rows.append(f"| `{name}` | {_cell(text)} |")
    return "\n".join(["| Option | |", "|---|---|", *rows, "", ""]) if rows else ""


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")


def settings() -> str:
    """Every key with its variable, type and default, and the comment of etc/hvcpd.yaml."""
    keys = {".".join(map(str, key)): (key, hint) for key, hint in leaf_keys(Settings)}
    comments = _comments((ROOT / "etc" / "hvcpd.yaml").read_text(encoding="utf-8"), keys)
    parts = [f"{MADE}# Settings\n\n[`etc/hvcpd.yaml`](../../etc/hvcpd.yaml) lists them too, ready to be edited.\n\n"]
    for dotted, (key, hint) in keys.items():
        default = _default(Settings, key)
        parts.append(f"## `{dotted}`\n\nVariable `{variable_of(key)}`, {_type(hint)}{default}.\n\n")
        if comment := comments.get(dotted):
            parts.append(f"{_cell(comment)}\n\n")
    return "".join(parts)


def _comments(text: str, keys: Collection[str]) -> dict[str, str]:
    """The comment above each key of the example file; keys of a group are indented there, and have dots here."""
    known = {*keys, *(key.partition(".")[0] for key in keys)}
    found: dict[str, str] = {}
    block: list[str] = []
    group = ""
    for line in text.splitlines():
        written = re.match(r"(?:# )?(  )?(\w+):(?: |$)", line)
        key = written and (f"{group}.{written[2]}" if written[1] else written[2])
        if written and key in known:
            group = group if written[1] else written[2]
            found[key] = " ".join(block)
            block = []
        elif line.lstrip("# "):
            block.append(line.lstrip("# "))
        else:
            block = []
    return found


def _default(type_: type, key: tuple[object, ...]) -> str:
    here = type_
    for part in key[:-1]:
        field = next(each for each in dataclasses.fields(here) if each.name == part)
        here = type(field.default_factory() if field.default_factory is not dataclasses.MISSING else field.default)
    field = next(each for each in dataclasses.fields(here) if each.name == key[-1])
    if field.default is not dataclasses.MISSING:
        return f", default `{_plain(field.default)}`"
    if field.default_factory is not dataclasses.MISSING:
        made = field.default_factory()
        return "" if isinstance(made, Path) else f", default `{_plain(made)}`"
    return ", required"


def _plain(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(str, value))}]"
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    return str(value)


def _type(hint: object) -> str:
    """A type as YAML's user knows it."""
    if get_origin(hint) is Literal:
        return " or ".join(map(str, get_args(hint)))
    if get_origin(hint) in (Union, UnionType):
        return " or ".join(_type(each) for each in get_args(hint))
    if get_origin(hint) is tuple:
        return f"list of {_type(get_args(hint)[0])}"
    names = {str: "text", Path: "file name", int: "whole number", float: "number", bool: "true or false"}
    return names.get(hint, "null" if hint is type(None) else "mapping") if isinstance(hint, type) else "mapping"


def sentences() -> str:
    """Every form of the phrasebook."""
    head = (
        f"{MADE}# Sentence forms\n\n`[…]` may be left out, `(…|…)` is a choice, and `<…>` stands for a name, number or "
        f"task of your team: `hvcpctl phrases` prints them. OPENING is `{OPENING}`. A speaker pauses at commas.\n\n"
    )
    rows = [f"| `{_form(form.pattern)}` | {_cell(form.meaning)} |" for form in FORMS]
    return "\n".join([f"{head}| Form | Meaning |", "|---|---|", *rows, ""])


def _form(pattern: str) -> str:
    return pattern.replace(OPENING, "OPENING").replace("|", "\\|")


def events() -> str:
    """Every event of the control socket."""
    parts = [f"{MADE}# Events\n\nOf the [control socket](../control.md), and of `hvcpctl simulate --json`.\n\n"]
    for name, type_ in sorted(KINDS.items()):
        only = " Sent only to clients that ask for it by name." if name in FREQUENT else ""
        document = " ".join((type_.__doc__ or "").split())
        parts.append(f"## `{name}`\n\n{_cell(document)}{only}\n\n| Field | Type |\n|---|---|\n")
        parts += [f"| `{each.name}` | `{_cell(str(each.type))}` |\n" for each in dataclasses.fields(type_)]
        parts.append("\n")
    return "".join(parts)


def modules() -> str:
    """The modules that other projects can use, by the first line of their docstrings."""
    parts = [f"{MADE}# Modules\n\n[Examples](python.md) show how to use them.\n\n"]
    for package in PACKAGES:
        parts.append(f"## `{package.replace('/', '.')}`\n\n| Module | |\n|---|---|\n")
        for path in sorted((ROOT / package).rglob("*.py")):
            if path.name.startswith("__"):
                continue
            name = path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".")
            first = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n\n")[0]
            parts.append(f"| `{name}` | {_cell(first)} |\n")
        parts.append("\n")
    return "".join(parts)


PAGES = {"commands": commands, "settings": settings, "sentences": sentences, "events": events, "modules": modules}


def main() -> int:
    """Write the pages; with --check print the names of those that differ, and change nothing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="print what differs, and change nothing")
    check = parser.parse_args().check
    status = 0
    for name, make in PAGES.items():
        path, text = FOLDER / f"{name}.md", make()
        if check and (not path.exists() or path.read_text(encoding="utf-8") != text):
            sys.stdout.write(f"{path.relative_to(ROOT)} is out of date\n")
            status = 1
        elif not check:
            path.write_text(text, encoding="utf-8")
    return status


if __name__ == "__main__":
    sys.exit(main())
