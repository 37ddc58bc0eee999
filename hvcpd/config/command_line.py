"""Command lines: a parser with one-line messages that name a remedy, and output that may fail.

Light, since every command builds the parser of all commands.
"""

from __future__ import annotations

import argparse
import codecs
import os
import sys
from collections.abc import Callable
from io import TextIOWrapper, UnsupportedOperation
from pathlib import Path
from typing import Any, NoReturn, TextIO

from hvcpd.errors import EX_OK, EX_USER, nearest, unwritable

_MISSING = "the following arguments are required"
"""How argparse's message begins."""
_SYNONYMS = {"--names": "--robots", "--robots": "--names"}
"""Options for the same, of which each command has at most one: names that are known, and robots that are there."""
_PLAIN = "hvcpd-plain"
"""The name of our way to write what an output has no letters for."""
_LOOKS_LIKE = dict(zip("“”‘’–—−·→×│≥", ('"', '"', "'", "'", *"----", "->", "x", "|", ">="), strict=True))
"""Signs of our texts that Unicode (NFKD) does not take apart to ASCII."""


class _Help(argparse.HelpFormatter):
    """Help that breaks no path, option or word at the end of a line; lines that begin with a space stay as they are."""

    def _split_lines(self, text: str, width: int) -> list[str]:
        return _wrapped(" ".join(text.split()), width)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        lines: list[str] = []
        for line in text.splitlines():
            lines += [line] if line.startswith(" ") else _wrapped(line, width - len(indent)) or [""]
        return "\n".join(indent + line for line in lines)


def _wrapped(text: str, width: int) -> list[str]:
    import textwrap  # for a help text alone, as in argparse

    return textwrap.wrap(text, width, break_on_hyphens=False, break_long_words=False)


def with_examples(text: str, *examples: str) -> str:
    """The end of a command's help: the text, then each example on a line of its own, to be copied."""
    title = "Examples:" if len(examples) > 1 else "Example:"
    return "\n".join([*([text, ""] if text else []), title, *(f"  {example}" for example in examples)])


class SkippedParser:
    """A stand-in for the parser of a command that is not run, which accepts and ignores all calls: building all parsers
    takes longer than most commands do."""

    def __getattr__(self, _name: str) -> Callable[..., SkippedParser]:
        return lambda *_arguments, **_options: self


class Parser(argparse.ArgumentParser):
    """A parser with one-line error messages that suggest the intended word; a bare command shows its help."""

    usage_status = EX_USER
    """The exit status of wrong usage."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        options.setdefault("formatter_class", _Help)
        self._given: list[str] = []
        super().__init__(*arguments, **options)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        given = sys.argv[1:] if args is None else list(args)
        if not given and self._subparsers is not None:
            self.print_help()
            self.exit(EX_OK)
        self._given = given
        found, unknown = super().parse_known_args(given, namespace)
        if unknown:
            self.error(self._unknown(unknown[0]))
        return found, unknown

    def error(self, message: str) -> NoReturn:
        if message.startswith(_MISSING) and (wrong := self._wrong_option()):
            message = self._unknown(wrong)
        print_error(self.prog, f"{message}{' See' if message.endswith('?') else '; see'} {self.prog} --help")
        self.exit(self.usage_status)

    def _print_message(self, message: str, file: Any = None) -> None:
        """As argparse's, which hides it when the output is full."""
        (file or sys.stderr).write(message)

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        if not arg_string and (action.option_strings or action.type):  # a path would be the current folder
            raise argparse.ArgumentError(action, "it is empty; give a value, or leave it out")
        if action.type is Path and arg_string == "-":
            raise argparse.ArgumentError(action, "it takes no pipe; name a file (one that is called - is ./-)")
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError:
            if action.type is int:
                raise argparse.ArgumentError(action, f"'{arg_string}' is not a whole number") from None
            raise

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is None or value in action.choices:
            return
        choices = [str(choice) for choice in action.choices]
        near = nearest(str(value), choices)
        if isinstance(action, argparse._SubParsersAction):
            what = str(action.metavar or "command").lower()
            hint = f"; did you mean '{near}'?" if near else ""
            if value in self._given and any(each[:1] == "-" for each in self._given[: self._given.index(value)]):
                hint = f"; options come after the {what}"
            raise argparse.ArgumentError(None, f"there is no {what} '{value}'{hint}")
        hint = f"did you mean '{near}'?" if near else f"choose from {', '.join(choices)}"
        raise argparse.ArgumentError(action, f"'{value}' is not one of the choices; {hint}")

    def _wrong_option(self) -> str | None:
        """The first that was given and looks like an option, but is none: argparse looks for what is missing first."""
        given = self._given[: self._given.index("--")] if "--" in self._given else self._given
        for argument in given:
            name = argument.partition("=")[0]
            known = (name.startswith("--") and any(o.startswith(name) for o in self._option_string_actions)) or (
                not name.startswith("--") and name[:2] in self._option_string_actions
            )
            if name.startswith("-") and name != "-" and not name[1].isdigit() and not known:
                return argument
        return None

    def _unknown(self, argument: str) -> str:
        if not argument.startswith("-") or argument in ("-", *self._option_string_actions):  # an option after a --
            if all(action.option_strings for action in self._actions):
                return f"'{argument}' needs an option before it"
            return f"'{argument}' is one argument too many; put what has spaces in quotes"
        name = argument.partition("=")[0]
        synonym = _SYNONYMS.get(name)
        near = synonym if synonym in self._option_string_actions else nearest(name, self._option_string_actions)
        return f"there is no option {argument}" + (f"; did you mean {near}?" if near else "")


def prepare_streams() -> None:
    """Replace standard streams that the parent process has closed by /dev/null: an input that has ended. The others
    write each line at once, to a pipe, too; what they cannot write, as a terminal that knows ASCII alone, becomes what
    looks most like it. Bytes of the input that are no text become U+FFFD."""
    codecs.register_error(_PLAIN, _in_plain_letters)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open(mode))  # noqa: SIM115 - open to the end
        elif isinstance(stream := getattr(sys, name), TextIOWrapper):
            is_output = mode == "w"
            stream.reconfigure(errors=_PLAIN if is_output else "replace", line_buffering=is_output)


def _in_plain_letters(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    from unicodedata import normalize  # hardly ever needed

    def plain(letter: str) -> str:
        found = _LOOKS_LIKE.get(letter) or normalize("NFKD", letter)
        return "".join(c for c in found if c.isascii()) or "?"

    return "".join(map(plain, error.object[error.start : error.end])), error.end


def print_error(program: str, text: str) -> None:
    """Write to standard error, each line with the program's name; nothing happens if that is closed or full. Control
    characters, which may come from a file or an argument, are shown as U+FFFD."""
    lines = ("".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in line) for line in text.splitlines())
    try:
        sys.stderr.writelines(f"{program}: {line}\n" for line in lines)
        sys.stderr.flush()
    except OSError:
        discard_output(sys.stderr)


def discard_output(stream: TextIO) -> None:
    """Discard what a stream that cannot be written still holds; otherwise Python complains when the process ends."""
    try:
        descriptor = stream.fileno()
    except (UnsupportedOperation, AttributeError):
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)


def output_fault(error: OSError | UnicodeEncodeError) -> str:
    """Why the output, or a text or file that a command did not ask for, cannot be used, and what to do."""
    if isinstance(error, UnicodeEncodeError):
        wrong = error.object[error.start : error.end][:40]
        return f"{wrong!a} cannot be written as {error.encoding}; leave it out"
    if error.filename is not None:  # no fault of the output
        return f"{error.filename}: {error.strerror}; check its name, who may use it, and its disk"
    return unwritable("standard output", error, "send it elsewhere")
