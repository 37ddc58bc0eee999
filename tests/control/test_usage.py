"""Wrong usage: one line, with the word that was probably meant; help that can be copied."""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from hvcpd.control.cli import main, make_parser
from hvcpd.control.overview import OVERVIEW
from release.reference import EXIT_STATUS
from tests.control.conftest import Refuse


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["stpo"], "hvcpctl: there is no command 'stpo'; did you mean 'stop'? See hvcpctl --help"),
        (["check"], "hvcpctl: there is no command 'check'; did you mean 'check-vocabulary'? See hvcpctl --help"),
        (["xyzzy"], "hvcpctl: there is no command 'xyzzy'; see hvcpctl --help"),
        (["key", "shwo"], "hvcpctl key: there is no action 'shwo'; did you mean 'show'? See hvcpctl key --help"),
        (["stop", "--nmae", "Rob"], "hvcpctl stop: there is no option --nmae; did you mean --name? See"),
        (["--name", "Rob", "status"], "hvcpctl: there is no command 'Rob'; options come after the command; see"),
        (["task", "--name", "Rob", "again", "3"], "there is no action 'Rob'; options come after the action; see"),
        (["simulate", "--sede=3"], "hvcpctl simulate: there is no option --sede=3; did you mean --seed? See"),
        (["--verison"], "hvcpctl: there is no option --verison; did you mean --version? See hvcpctl --help"),
        (["simulate", "--names", "Rob"], "hvcpctl simulate: there is no option --names; did you mean --robots? See"),
        (["say", "--robots", "Rob"], "hvcpctl say: there is no option --robots; did you mean --names? See"),
        (["say", "--naems", "Rob"], "hvcpctl say: there is no option --naems; did you mean --names? See"),
        (["say", "-oo.wav", "--rat", "1"], "hvcpctl say: the following arguments are required: TEXT; see"),
        (["phrases", "--format", "htm"], "'htm' is not one of the choices; did you mean 'html'? See"),
        (["simulate", "--mode", "xyz"], "'xyz' is not one of the choices; choose from volunteer, coordinate; see"),
        (["task", "again", "thrice"], "argument NUMBER: 'thrice' is not a task number from 1 to 99; see"),
        (["task", "skip", "-3"], "argument NUMBER: '-3' is not a task number from 1 to 99; see"),
        (["task", "skip", "--", "3", "--json"], "hvcpctl task skip: '--json' is one argument too many; put what has"),
        (
            ["task", "add", "water the rose", "--number", "9", "--robots", "two"],
            "'two' is not a whole number from 1 to",
        ),
        (["duet", "--port", "99999"], "argument --port: '99999' is not a port from 0 to 65535; see"),
        (["status", "--name", "R2-D2"], "argument --name: the name 'R2-D2' is not a letter followed by"),
        (["transcript", "--name", "R2-D2"], "argument --name: the name 'R2-D2' is not a letter followed by"),
        (["pronounce", "rose", "--as", "R2-D2"], "argument --as: the name 'R2-D2' is not a letter followed by"),
        (["duet", "--as", "Rob,Bot"], "argument --as: give one name, as in: Rob; see"),
        (["drive", "forward", "1m"], "argument M: '1m' is not a number from -10 to 10 m; see"),
        (["evaluate", "wak"], "'wak' is not one of the choices; did you mean 'wake'? See"),
        (["say", "-o", "x.MP3", "stop"], "argument -o/--output: only WAV is written; name it x.wav; see"),
        (
            ["report", "--html", "-"],
            "argument --html: it takes no pipe; name a file (one that is called - is ./-); see",
        ),
        (["mcap", "-", "-"], "argument FILE: it takes no pipe; name a file"),
        (["simulate", "--report", ""], "argument --report: it is empty; give a value, or leave it out; see"),
        (["say", "stop", "-o", ""], "argument -o/--output: it is empty; give a value, or leave it out; see"),
        (["hear", ""], "argument FILE.wav: it is empty; give a value, or leave it out; see"),
        (["status", "--name", ""], "argument --name: it is empty; give a value, or leave it out; see"),
        (["key", "new", "team.key"], "hvcpctl key new: 'team.key' needs an option before it; see"),
        (["say", "Hi", "Rob"], "hvcpctl say: 'Rob' is one argument too many; put what has spaces in quotes; see"),
    ],
)
def test_what_was_meant_is_named_in_one_line(arguments: list[str], message: str, refused: Refuse) -> None:
    told = refused(*arguments)
    assert message in told
    assert len(told.splitlines()) == 1


@pytest.mark.parametrize("arguments", [[], ["key"], ["drive"]])
def test_a_command_alone_shows_its_help(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 0
    out, err = capsys.readouterr()
    assert out.startswith("usage: ")
    assert "--help" in out
    assert err == ""


@pytest.mark.parametrize(
    ("option", "wrong", "why"),
    [
        ("--place", "1.2", "'1.2' is not x and y in metres; write for example 1.2,0.5"),
        ("--place", "1,2,3", "'1,2,3' is not x and y in metres; write for example 1.2,0.5"),
        ("--place", "nan,3", "nan is not from -50 to 50 m"),
        ("--place", "1e9,3", "1e9 is not from -50 to 50 m"),
        ("--place", "1,b", "'b' is not a number from -50 to 50 m"),
        ("--after", "3,b", "'b' is not a task number from 1 to 99"),
    ],
)
def test_what_is_wrong_with_a_new_task_is_told_by_its_option(
    option: str, wrong: str, why: str, refused: Refuse
) -> None:
    """The robot told it by the key of its file: "task 6: x_m: expected a number, found the text 'nan'"."""
    told = refused("task", "add", "water the red tulip", "--number", "6", option, wrong)
    assert told.startswith(f"hvcpctl task add: argument {option}: {why}; see")


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from parsers(below)


@pytest.mark.parametrize(
    ("arguments", "usage"), [(["help"], "usage: hvcpctl [-h]"), (["help", "say"], "usage: hvcpctl say")]
)
def test_help_is_a_word_too(arguments: list[str], usage: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 0
    assert capsys.readouterr().out.startswith(usage)


def test_no_help_breaks_a_path_an_option_or_an_example() -> None:
    for parser in parsers(make_parser()):
        text = parser.format_help()
        for line in (parser.epilog or "").splitlines():
            assert not line.startswith("  ") or line in text.splitlines()
        broken = [line for line in text.splitlines() if line.endswith("-") and not line.endswith(" -")]
        assert broken == [], parser.prog


def test_the_overview_names_every_command_in_one_screen() -> None:
    lines = OVERVIEW.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    commands = next(a for a in make_parser()._actions if isinstance(a, argparse._SubParsersAction)).choices
    named = re.findall(r"[a-z-]+", OVERVIEW)
    assert [command for command in commands if command not in named] == []


def test_commands_without_json_give_their_reason() -> None:
    """docs/reference/commands.md has them."""
    reasons = EXIT_STATUS.split("## JSON")[1]
    commands = next(a for a in make_parser()._actions if isinstance(a, argparse._SubParsersAction)).choices
    bare = [
        name
        for name, parser in commands.items()
        if "--json" not in {*parser._option_string_actions, *_of_actions(parser)}
    ]
    assert [name for name in bare if f"`{name}`" not in reasons] == []
    assert [name for name in commands if name not in bare and f"`{name}`" in reasons] == []


def _of_actions(parser: argparse.ArgumentParser) -> set[str]:
    """The options of a command's own actions, as of `drive forward`."""
    choices = [a.choices for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return {option for each in choices for sub in each.values() for option in sub._option_string_actions}


def test_every_command_has_an_example_that_its_own_parser_takes() -> None:
    parser = make_parser()
    for command in list(parsers(parser))[1:]:
        lines = (command.epilog or "").replace("\\\n", " ").splitlines()
        examples = [line for line in lines if line.startswith("  hvcpctl ")]
        assert examples, f"{command.prog} --help shows no example"
        assert sum(line in ("Example:", "Examples:") for line in lines) == 1, f"{command.prog}: examples twice"
        for example in examples:
            parser.parse_args(shlex.split(example.replace(" > ", " # "), comments=True)[1:])


def test_a_command_alone_takes_the_same_options_as_among_all() -> None:
    """Only the wanted command's parser is built, since all of them take longer than most commands do."""
    for command, parser in _parsers(make_parser()).items():
        alone = _parsers(make_parser(command))
        assert alone.keys() == _parsers(make_parser()).keys(), "all are known, to tell which was meant"
        assert [each for each in alone.values() if isinstance(each, argparse.ArgumentParser)] == [alone[command]]
        assert alone[command].format_help() == parser.format_help()


def _parsers(parser: argparse.ArgumentParser) -> Mapping[str, argparse.ArgumentParser]:
    [commands] = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    return commands.choices


def test_whatever_reads_a_file_takes_a_pipe_or_refuses_it() -> None:
    """A file of the name "-" was looked for, or written."""
    parser = make_parser()
    assert parser.parse_args(["mcap", "-", "x.mcap"]).recording == Path("/dev/stdin")
    assert parser.parse_args(["mqtt", "--host", "x", "--password-file", "-"]).password_file == Path("/dev/stdin")
    assert parser.parse_args(["hear", "-"]).file == [Path("/dev/stdin")]
    assert parser.parse_args(["report", "--html", "./-"]).html == Path("-")


def test_the_help_of_mcap_says_how_a_robots_sound_gets_in() -> None:
    told = " ".join(_parsers(make_parser())["mcap"].format_help().split())
    assert all(part in told for part in ("--json --poses", "--sound", "control: {sound: true}"))


def test_a_tasks_number_may_be_written_as_it_is_spoken() -> None:
    for text in ("23", "twenty three", "Twenty-three"):
        assert make_parser().parse_args(["task", "again", text]).number == 23
