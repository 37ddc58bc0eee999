"""`hvcpctl hear --said`: why a sentence that was said was not understood."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hvcpd.control.cli import main
from hvcpd.control.hear.how_near import Nearness, as_line
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ
from tests.control.conftest import Ran, Refuse
from tests.control.test_alternatives import said

SENTENCE = "Hi Bot, I am Rob, water the yellow rose"
NEAR = Nearness(1.5, 4.0, "person", 0.75, 0.65, SENTENCE, 0.65)


def told(near: Nearness) -> str:
    return as_line(near, SENTENCE, json_wanted=False).removeprefix("    1.50 –   4.00 s        as a person's: ")


def test_how_near_it_was_is_told_in_words() -> None:
    assert told(NEAR) == "likeliest, but only 65% sure; it counts from 75%"
    assert told(replace(NEAR, likeliest_confidence=0.9)).startswith("likeliest, 90% sure, but not confirmed (")
    assert told(replace(NEAR, likeliest="Stop", confidence=0.1)) == (
        "10% sure; likelier, 65%, is “Stop”; it counts from 75%"
    )
    assert told(replace(NEAR, likeliest="Stop", confidence=None)).startswith("likelier, 65%, is “Stop”")
    assert told(replace(NEAR, likeliest=None, likeliest_confidence=None)) == "like no sentence"
    assert json.loads(as_line(NEAR, SENTENCE, json_wanted=True)) == {"said": SENTENCE} | vars(NEAR)


def test_what_is_no_sentence_of_the_phrasebook_is_told_before_listening(refused: Refuse, tmp_path: Path) -> None:
    write_wav(tmp_path / "x.wav", np.zeros(SAMPLE_RATE_HZ, np.float32))
    message = refused(
        "hear", tmp_path / "x.wav", "--names", "Rob,Bot", "--said", "Hi Bot, I am Rob, water the daffodil"
    )
    assert "'daffodil' is not in the phrasebook after 'hi bot i am rob water the'" in message


@pytest.mark.slow
def test_a_recording_that_was_not_understood(tmp_path: Path, capsys: pytest.CaptureFixture[str], ran: Ran) -> None:
    """It took --said only with --learn-alternatives."""
    wav = tmp_path / "x.wav"
    write_wav(wav, said("hi bot", "i am rob", "water the yellow rose"))
    asked = ["hear", str(wav), "--names", "Rob,Bot", "--json", "--said"]
    (line,) = ran(*asked, SENTENCE).splitlines()
    assert json.loads(line)["text"] == SENTENCE, "understood: there is nothing to explain"
    other = "Hi Rob, I am Bot, water the blue rose"
    _, *near = map(json.loads, ran(*asked, other).splitlines())
    assert [(each["voice"], each["said"], each["likeliest"]) for each in near] == [
        ("robot", other, SENTENCE),
        ("person", other, SENTENCE),
    ]
    assert near[0]["confidence"] is None
    assert near[0]["likeliest_confidence"] > near[0]["needed"] == 0.8
    assert near[1]["confidence"] < 0.1
    write_wav(wav, np.zeros(SAMPLE_RATE_HZ, np.float32))
    assert main([*asked, SENTENCE]) == 0
    assert "no speech was noticed in" in capsys.readouterr().err
