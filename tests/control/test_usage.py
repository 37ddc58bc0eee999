"""Wrong usage: one line, with the word that was probably meant; help that can be copied."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import pytest

from hvcpd.control.cli import main, make_parser
from tests.control.conftest import Refuse


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["stpo"], "hvcpctl: there is no command 'stpo'; did you mean 'stop'?; see hvcpctl --help"),
        (["xyzzy"], "hvcpctl: there is no command 'xyzzy'; see hvcpctl --help"),
        (["key", "shwo"], "hvcpctl key: there is no action 'shwo'; did you mean 'show'?; see hvcpctl key --help"),
        (["stop", "--nmae", "Rob"], "hvcpctl stop: there is no option --nmae; did you mean --name?; see"),
        (["simulate", "--sede=3"], "hvcpctl simulate: there is no option --sede=3; did you mean --seed?; see"),
        (["--verison"], "hvcpctl: there is no option --verison; did you mean --version?; see hvcpctl --help"),
        (["say", "--naems", "Rob"], "hvcpctl say: there is no option --naems; did you mean --names?; see"),
        (["say", "-oo.wav", "--rat", "1"], "hvcpctl say: the following arguments are required: TEXT; see"),
        (["phrases", "--format", "htm"], "'htm' is none of the choices; did you mean 'html'?; see"),
        (["simulate", "--mode", "xyz"], "'xyz' is none of the choices; choose from volunteer, coordinate; see"),
        (["evaluate", "wak"], "'wak' is none of the choices; did you mean 'wake'?; see"),
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
    assert "show this help message" in out
    assert err == ""


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from parsers(below)


def test_no_help_breaks_a_path_an_option_or_an_example() -> None:
    for parser in parsers(make_parser()):
        text = parser.format_help()
        for line in (parser.epilog or "").splitlines():
            assert not line.startswith("  ") or line in text.splitlines()
        broken = [line for line in text.splitlines() if line.endswith("-") and not line.endswith(" -")]
        assert broken == [], parser.prog
