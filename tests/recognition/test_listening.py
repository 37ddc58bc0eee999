"""Names being spelled, beside everything else that is said."""

import gc
import random
import weakref
from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.make import make_robot, make_speech_recogniser
from hvcpd.assembly.name_registry import NameRegistry
from hvcpd.assembly.plan import HearingPlan, RobotPlan, TeamPlan
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.tasks import Place, TaskDefinition, TaskRepository, Tend
from hvcpd.coordination.actions import Role
from hvcpd.errors import PhraseError
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.stages import SpeechRecogniser
from hvcpd.robot.records import HeardRecord, LearnName
from hvcpd.robot.robot import Robot
from hvcpd.synthesis.voices import VOICES, Voice, voice_for

pytestmark = pytest.mark.slow

TASKS = TaskRepository((TaskDefinition(1, "water the red rose", Place(0.0, 0.0), (Tend(1.0),)),))
ZORG = m.Utterance("Zorg", m.ToAll(), None, m.Spelled("zorg"))
NOISE = 1e-3


BOOK = make_phrasebook(("Rob",), DEFAULT_TEAMS, TASKS)


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


def _said(utterance: m.Utterance, voice: Voice, words: Phrasebook, sound: Sound) -> Samples:
    speech = sound.speaker_in(voice).render(words.phrases(utterance)) * np.float32(0.3)
    return np.concatenate([np.zeros(16_000, np.float32), speech, np.zeros(24_000, np.float32)])


def _noisy(samples: Samples, seed: int = 1) -> Samples:
    noise = np.random.default_rng(seed).standard_normal(len(samples))
    return (samples + NOISE * noise).astype(np.float32)


def _hear(recogniser: SpeechRecogniser, samples: Samples) -> list[Event]:
    return [event for at in range(0, len(samples), 400) for event in recogniser.push(samples[at : at + 400])]


@pytest.mark.slow
def test_a_name_is_heard_in_every_voice_and_once(sound: Sound) -> None:
    recogniser = make_speech_recogniser(BOOK, ("Rob",), sound, strangers=True)
    for number, voice in enumerate(VOICES):
        events = _hear(recogniser, _noisy(_said(ZORG, voice, BOOK, sound), number))
        assert [BOOK.parse(e.words) for e in events if isinstance(e, Recognised)] == [ZORG], voice.name
        assert not [e for e in events if isinstance(e, Garbled)], voice.name


def test_ears_that_learn_keep_no_other_ears(sound: Sound) -> None:
    hearing = HearingPlan(prepared=False)
    recogniser, others = (
        make_speech_recogniser(BOOK, ("Rob",), sound, hearing, strangers=True),
        make_speech_recogniser(BOOK, ("Rob",), sound, hearing),
    )
    recogniser.adopt(others)
    kept = weakref.ref(others.first_pass)
    del others
    gc.collect()
    assert kept() is None
    recogniser.prepare(lambda: True)
    assert recogniser.first_pass._spelling is not None


def _robot(sound: Sound) -> tuple[Robot, NameRegistry]:
    role = Role("Bot", "plant", volunteer=False, listed=False)
    plan = RobotPlan(role, TeamPlan(("Bot",), strangers=True), TASKS, 1)
    return make_robot(plan, sound), NameRegistry(plan, sound)


def _live(robot: Robot, samples: Samples, roster: NameRegistry | None = None) -> list[object]:
    records: list[object] = []
    for at in range(0, len(samples), 400):
        new = robot.step(samples[at : at + 400], None).records
        records += new
        for record in new:
            if isinstance(record, LearnName) and roster is not None:
                robot.adopt(*roster.learn(record.name))
    return records


def test_a_robot_learns_a_name_and_understands_its_owner_from_then_on(sound: Sound) -> None:
    robot, roster = _robot(sound)
    voice = voice_for("Zorg")
    records = _live(robot, _noisy(_said(ZORG, voice, robot.phrasebook, sound)), roster)
    assert [r.name for r in records if isinstance(r, LearnName)] == ["Zorg"]
    assert robot.phrasebook.known_name("zorg") == "Zorg"
    assert robot.coordination.peers.get("Zorg") is not None
    clock_s = robot.now
    hello = m.Utterance("Zorg", m.ToTeam("plant"), None, m.Free())
    records = _live(robot, _noisy(_said(hello, voice, robot.phrasebook, sound)), roster)
    [heard] = [r for r in records if isinstance(r, HeardRecord)]
    assert heard.utterance == hello
    assert heard.start_s > clock_s, "its clock went on"


def test_before_it_is_learned_nobody_of_that_name_is_spoken_to(sound: Sound) -> None:
    robot, _ = _robot(sound)
    _live(robot, _noisy(_said(ZORG, voice_for("Zorg"), robot.phrasebook, sound)))
    assert robot.coordination.peers.all() == ()


def test_a_name_that_sounds_like_a_known_one_is_not_learned(sound: Sound) -> None:
    _, roster = _robot(sound)
    roster.learn("Anne")
    with pytest.raises(PhraseError, match="'Ann' sounds like 'Anne'"):
        roster.learn("Ann")
    assert roster.names == ("Bot", "Anne")


def test_a_name_that_it_was_told_is_not_forgotten(sound: Sound) -> None:
    _, roster = _robot(sound)
    roster.learn("Zorg")
    roster.learn("Anna", given=True)
    assert roster.names == ("Bot", "Anna", "Zorg")
    roster.learn("Gus")
    assert roster.names == ("Bot", "Anna", "Zorg", "Gus")


def test_sentences_are_heard_as_if_nobody_listened_for_names(sound: Sound) -> None:
    said = [_said(BOOK.sample(random.Random(seed)), VOICES[seed], BOOK, sound) for seed in range(2)]
    stream = _noisy(np.concatenate(said))
    alone, beside = (
        _hear(make_speech_recogniser(BOOK, ("Rob",), sound, strangers=strangers), stream) for strangers in (False, True)
    )
    assert [e for e in alone if isinstance(e, Recognised)] == [e for e in beside if isinstance(e, Recognised)]
