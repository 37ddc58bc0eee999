"""`hvcpctl completion bash|zsh|fish`: what the shell offers at the tabulator key, drawn from the parser itself."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from hvcpd.control.cli import make_parser
from hvcpd.errors import EX_OK


@dataclass(frozen=True)
class Option:
    """One option of a command: its spellings, and what it takes."""

    names: tuple[str, ...]
    text: str
    takes_value: bool
    choices: tuple[str, ...]


@dataclass(frozen=True)
class Node:
    """One command: the words that lead to it, what it is for, its options, and the commands or choices below it."""

    path: tuple[str, ...]
    text: str
    options: tuple[Option, ...]
    words: tuple[str, ...]


def tree(parser: argparse.ArgumentParser, path: tuple[str, ...] = (), text: str = "") -> Iterator[Node]:
    """All commands of a parser, outer ones first."""
    below: dict[str, argparse.ArgumentParser] = {}
    helps: dict[str, str] = {}
    options, words = [], list[str]()
    for action in parser._actions:
        choices = tuple(map(str, action.choices or ()))
        if isinstance(action, argparse._SubParsersAction):
            below = dict(action.choices)
            helps = {each.dest: each.help or "" for each in action._choices_actions}
        if action.option_strings:
            options.append(Option(tuple(action.option_strings), action.help or "", action.nargs != 0, choices))
        else:
            words += choices
    yield Node(path, text, tuple(options), tuple(words))
    for name, inner in below.items():
        yield from tree(inner, (*path, name), helps.get(name, ""))


def bash(program: str, nodes: list[Node]) -> str:
    """A bash completion: file names are offered wherever nothing else is."""
    steps = [f'            "{_key(n.path[:-1])} {n.path[-1]}") path="{_key(n.path)}" ;;' for n in nodes if n.path]
    words, values = [], []
    for node in nodes:
        options = " ".join(name for option in node.options for name in option.names)
        words.append(f'        "{_key(node.path)}") words="{" ".join(node.words)}" options="{options}" ;;')
        for option in node.options:
            if option.takes_value:
                pattern = "|".join(f'"{_key(node.path)} {name}"' for name in option.names)
                values.append(f'        {pattern}) words="{" ".join(option.choices)}" options="" ;;')
    return "\n".join(
        [
            f"_{program}() {{",
            '    local cur=${COMP_WORDS[COMP_CWORD]} path="" words="" options="" i',
            "    for ((i = 1; i < COMP_CWORD; i++)); do",
            '        case "$path ${COMP_WORDS[i]}" in',
            *steps,
            "        esac",
            "    done",
            '    case "$path" in',
            *words,
            "    esac",
            '    case "$path ${COMP_WORDS[COMP_CWORD-1]}" in',
            *values,
            "    esac",
            "    [[ $cur == -* ]] && words=$options",
            '    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$cur")',
            "}",
            f"complete -o default -F _{program} {program}",
            "",
        ]
    )


def zsh(program: str, nodes: list[Node]) -> str:
    """The same for zsh, which reads bash's completions."""
    script = bash(program, nodes).replace("mapfile -t COMPREPLY < <(", "COMPREPLY=($(").replace('"$cur")', '"$cur"))')
    return f"autoload -U +X compinit bashcompinit\ncompinit\nbashcompinit\n{script}"


def fish(program: str, nodes: list[Node]) -> str:
    """A fish completion, with the helps beside the words."""
    lines = [f"complete -c {program} -f -n __fish_use_subcommand"]
    for node in nodes:
        seen = f"'__fish_seen_subcommand_from {node.path[-1]}'" if node.path else "__fish_use_subcommand"
        if node.path:
            above = f"'__fish_seen_subcommand_from {node.path[-2]}'" if node.path[1:] else "__fish_use_subcommand"
            lines.append(f"complete -c {program} -n {above} -a {node.path[-1]} -d {_quoted(node.text)}")
        for option in node.options:
            flags = " ".join(f"-l {n[2:]}" if n.startswith("--") else f"-s {n[1:]}" for n in option.names)
            value = f" -xa {_quoted(' '.join(option.choices))}" if option.choices else " -r" * option.takes_value
            lines.append(f"complete -c {program} -n {seen} {flags}{value} -d {_quoted(option.text)}")
    return "\n".join(lines) + "\n"


SHELLS = {"bash": bash, "zsh": zsh, "fish": fish}


def run(options: argparse.Namespace) -> int:
    """Print the completion for a shell."""
    sys.stdout.write(SHELLS[options.shell]("hvcpctl", list(tree(make_parser()))))
    return EX_OK


def _key(path: tuple[str, ...]) -> str:
    return "/".join(path)


def _quoted(text: str) -> str:
    return shlex.quote(text.replace("%%", "%"))
