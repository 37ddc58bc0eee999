"""What people say beside the robots' own sentences is heard too: "please", and reports of a shift."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hil_fakes.room import PinkNoise
from hvcpd.assembly.make import make_template_recogniser
from hvcpd.assembly.sound import make_phrasebook, make_sound
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.language import messages as m
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.template_recogniser import TemplateRecogniser
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import voice_for

NAMES = ("Rob", "Bot")
BLOCK = 400
BOOK = make_phrasebook(NAMES, DEFAULT_TEAMS, load_tasks(default_tasks_path()))

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recogniser(units: Path) -> TemplateRecogniser:
    return make_template_recogniser(BOOK, NAMES, make_sound(None, units))


def said(phrases: tuple[str, ...], units: Path, speech_dbfs: float = -35.0, noise_dbfs: float = -55.0) -> Samples:
    """A second of pink noise, the phrases in Bot's voice over it, and another second; 16 kHz, float32."""
    speech = Speaker(voice_for("Bot"), (sound := make_sound(None, units)).lexicon, sound.cache).render(
        [tuple(phrase.split()) for phrase in phrases]
    )
    loud = speech[np.abs(speech) > 1e-4]
    silence = np.zeros(SAMPLE_RATE_HZ, np.float32)
    clean = np.concatenate([silence, speech * (10.0 ** (speech_dbfs / 20.0) / np.sqrt(np.mean(loud**2))), silence])
    return np.asarray(clean + PinkNoise(10.0 ** (noise_dbfs / 20.0), 7).take(len(clean)), np.float32)


@pytest.mark.parametrize(
    ("phrases", "meaning"),
    [
        (("rob", "please come back"), m.Utterance(None, m.ToRobot("Rob"), None, m.ComeBack())),
        (("rob", "turn left please"), m.Utterance(None, m.ToRobot("Rob"), None, m.TurnBy(90.0))),
        (("who is here please",), m.Utterance(None, None, None, m.WhoHere())),
        (("please stop",), m.Utterance(None, None, None, m.Stop())),
        (("rob stop please",), m.Utterance(None, m.ToRobot("Rob"), None, m.Stop())),
        (("stop",), m.Utterance(None, None, None, m.Stop())),
        (
            ("hi rob", "i am bot", "please water the yellow rose"),
            m.Utterance("Bot", m.ToRobot("Rob"), None, m.Order(m.TaskByName("water the yellow rose"))),
        ),
        (("hi all", "i am bot", "report"), m.Utterance("Bot", m.ToAll(), None, m.ReportWanted())),
        (
            ("hi rob", "i am bot", "member of team plant", "report", "completing task three", "battery twelve volts"),
            m.Utterance("Bot", m.ToRobot("Rob"), "plant", m.Report(m.Doing.WORKING, m.TaskByNumber(3), 12.0)),
        ),
        (
            ("hi rob", "i am bot", "report", "i am free", "battery eleven and a half volts"),
            m.Utterance("Bot", m.ToRobot("Rob"), None, m.Report(m.Doing.FREE, None, 11.5)),
        ),
    ],
)
def test_it_is_heard(
    phrases: tuple[str, ...], meaning: m.Utterance, recogniser: TemplateRecogniser, units: Path
) -> None:
    sound = said(phrases, units)
    blocks = (sound[start : start + BLOCK] for start in range(0, len(sound) - BLOCK + 1, BLOCK))
    events = [event for block in blocks for event in recogniser.push(block)]
    assert [BOOK.parse(e.words) for e in events if isinstance(e, Recognised)] == [meaning]
