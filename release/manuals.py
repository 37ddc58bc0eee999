"""Manual pages, made of the parsers of both commands and of the commented settings.

python -m release.manuals FOLDER        # FOLDER/man1/hvcpd.1.gz, man1/hvcpctl.1.gz, man5/hvcpd.yaml.5.gz
"""

from __future__ import annotations

import argparse
import gzip
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from hvcpd import __version__
from hvcpd.cli import make_parser as make_hvcpd
from hvcpd.config.settings_file import commented_settings
from hvcpd.control.cli import make_parser as make_hvcpctl

_KEY = re.compile(r"#? ?([a-z_]+):( |$)")
"""A setting at the outermost level, commented out or not."""


def put_manuals(folder: Path) -> None:
    """Write all pages below `folder`, as usr/share/man has them. Raises OSError."""
    pages = {
        "man1/hvcpd.1": command_page(make_hvcpd(), "hvcpctl(1), hvcpd.yaml(5)"),
        "man1/hvcpctl.1": command_page(make_hvcpctl(), "hvcpd(1), hvcpd.yaml(5)"),
        "man5/hvcpd.yaml.5": settings_page(commented_settings()),
    }
    for name, text in pages.items():
        path = folder / f"{name}.gz"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(gzip.compress(text.encode(), mtime=0))


def command_page(parser: argparse.ArgumentParser, see_also: str) -> str:
    """Return the page of a command: usage, options, and the same of each of its own commands."""
    name, says = parser.prog, parser.description or ""
    lines = [_title(name, 1), ".SH NAME", f"{name} \\- {_quoted(says.rstrip('.'))}", ".SH SYNOPSIS", *_usage(parser)]
    lines += [".SH DESCRIPTION", *_text(says), ".SH OPTIONS", *_options(parser)]
    commands = list(_commands(parser, ""))
    lines += [".SH COMMANDS", *commands] if commands else []
    return _page([*lines, ".SH EXIT STATUS AND NOTES", *_text(parser.epilog or "")], see_also)


def _commands(parser: argparse.ArgumentParser, before: str) -> Iterator[str]:
    """Its commands, each with its options, and theirs."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            helps = {choice.dest: choice.help or "" for choice in action._choices_actions}
            for command, sub in action.choices.items():
                yield f".SS {_quoted(before + command)}"
                yield from (*_text(helps.get(command, "")), *_usage(sub), *_options(sub), *_text(sub.epilog or ""))
                yield from _commands(sub, f"{before}{command} ")


def settings_page(example: str) -> str:
    """Return the page of the settings' file: each group of its comments under its keys."""
    lines = [_title("hvcpd.yaml", 5), ".SH NAME", "hvcpd.yaml \\- settings of the daemon hvcpd", ".SH DESCRIPTION"]
    for number, group in enumerate(re.split(r"\n\s*\n", example.strip())):
        rows = group.splitlines()
        first = next((i for i, row in enumerate(rows) if _KEY.match(row)), len(rows))
        keys = [found[1] for row in rows[first:] if (found := _KEY.match(row))]
        if number == 1:
            lines.append(".SH SETTINGS")
        if keys:
            lines.append(f".SS {_quoted(', '.join(keys))}")
        lines += _text("\n".join(row.lstrip("# ") for row in rows[:first]))
        if keys:
            lines += [".PP", ".nf", ".RS", *(_quoted(re.sub("^# ?", "", row)) for row in rows[first:]), ".RE", ".fi"]
    files = [".SH FILES", ".I /etc/hvcpd/hvcpd.yaml"]
    return _page([*lines, *files], "hvcpd(1), hvcpctl(1)")


def _title(name: str, section: int) -> str:
    return f'.TH {name.upper()} {section} "" "hvcpd {__version__}"'


def _page(lines: Sequence[str], see_also: str) -> str:
    return "\n".join([*lines, ".SH SEE ALSO", _quoted(see_also)]) + "\n"


def _usage(parser: argparse.ArgumentParser) -> Iterator[str]:
    usage = " ".join(parser.format_usage().removeprefix("usage: ").split())
    yield from (".PP", _quoted(usage))


def _options(parser: argparse.ArgumentParser) -> Iterator[str]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction | argparse._HelpAction):
            continue
        shown = ", ".join(action.option_strings) or str(action.metavar or action.dest)
        choices = "|".join(map(str, action.choices or ()))
        value = "" if action.nargs == 0 or not action.option_strings else f" {action.metavar or choices or 'VALUE'}"
        yield from (".TP", f".B {_quoted(shown + value)}")
        yield _quoted((action.help or choices).replace("%%", "%")) or "\\&"


def _text(text: str) -> Iterator[str]:
    """Paragraphs; lines that begin with a space, which are examples, stay as they are."""
    for line in text.splitlines():
        if line.startswith(" "):
            yield from (".PP", ".nf", _quoted(line), ".fi")
        elif line.strip():
            yield _quoted(line)
        else:
            yield ".PP"


def _quoted(text: str) -> str:
    """As roff has it: no backslash, hyphen or leading dot of the text is an order to it."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{text}" if text[:1] in (".", "'") else text


def main(arguments: Sequence[str]) -> int:
    """Write the pages; returns the exit status."""
    parser = argparse.ArgumentParser(prog="release.manuals", description="Write the manual pages.")
    parser.add_argument("folder", type=Path)
    put_manuals(parser.parse_args(arguments).folder)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
