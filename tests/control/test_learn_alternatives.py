"""What a recording sounded like that was not understood, as YAML for the task file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from hvcpd.control.cli import main, make_parser
from hvcpd.control.hear.learn_alternatives import Proposal, as_yaml
from hvcpd.control.simulate.team import load_team
from hvcpd.hardware.soundfile import write_wav
from tests.control.conftest import Ran, Refuse
from tests.control.test_alternatives import said

TASKS = """tasks:
  - {number: 1, name: water the indigo rose, actions: [{wait: 1}]}
  - {number: 2, name: water the green rose, actions: [{wait: 1}]}
"""
SENTENCE = "Hi Bot, I am Rob, water the indigo rose"


def learned(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[str, str]:
    assert main(["hear", "--learn-alternatives", "--names", "Rob,Bot", *map(str, arguments)]) == 0
    out, err = capsys.readouterr()
    return out, err


@pytest.fixture
def tasks(tmp_path: Path) -> Path:
    path = tmp_path / "tasks.yaml"
    path.write_text(TASKS)
    return path


@pytest.fixture
def basket(tmp_path: Path) -> Path:
    path = tmp_path / "basket.wav"
    write_wav(path, said("hi bot", "i am rob", "water the basket rose"))
    return path


@pytest.mark.slow  # renders the whole lexicon in one voice
def test_a_word_that_was_said_otherwise_is_proposed_and_heard_from_then_on(
    tasks: Path, basket: Path, capsys: pytest.CaptureFixture[str], ran: Ran
) -> None:
    out, err = learned(capsys, basket, "--tasks", tasks, "--said", SENTENCE)
    assert err == ""
    assert out.startswith("# basket.wav ")
    assert f'perhaps "{SENTENCE}": "basket" for "indigo"' in out
    assert yaml.safe_load(out) == {"alternatives": {"indigo": ["basket"]}}
    assert SENTENCE not in ran("hear", basket, "--tasks", tasks, "--names", "Rob,Bot")
    tasks.write_text(TASKS + out)
    assert SENTENCE in ran("hear", basket, "--tasks", tasks, "--names", "Rob,Bot")


@pytest.mark.slow
def test_what_would_be_taken_for_another_word_is_not_proposed(tasks: Path, basket: Path) -> None:
    """As if the sentence had been heard with "green" in it."""
    options = make_parser().parse_args(["hear", "--learn-alternatives", str(basket), "--tasks", str(tasks)])
    out = as_yaml([Proposal("indigo", ("green",), SENTENCE, "green.wav", 1.0, 1.4)], load_team(options, ("Rob", "Bot")))
    assert "\"green\" for \"indigo\"; not proposed: alternatives: 'green' cannot count as 'indigo'" in out
    assert yaml.safe_load(out) is None


def test_where_nothing_was_misunderstood_nothing_is_proposed(
    tasks: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good, quiet = tmp_path / "good.wav", tmp_path / "quiet.wav"
    write_wav(good, said("hi bot", "i am rob", "water the green rose"))
    write_wav(quiet, np.zeros(20_000, np.float32))
    out, err = learned(capsys, good, quiet, "--tasks", tasks)
    assert out == ""
    assert err == "hvcpctl: nothing to propose: nothing in these recordings was misunderstood\n"


def test_options_that_do_not_go_together(basket: Path, refused: Refuse) -> None:
    assert "hear takes one recording" in refused("hear", basket, basket)
