"""A robot notes who speaks in another voice than its name has, and takes it for what it is worth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.make import make_robot
from hvcpd.assembly.plan import HearingPlan, RobotPlan, SecurityPlan, TeamPlan
from hvcpd.assembly.sound import Sound, make_sound
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskRepository, default_tasks_path
from hvcpd.coordination.actions import Role
from hvcpd.coordination.states import State
from hvcpd.language.messages import NameTaken, NotUnderstood
from hvcpd.memory.journal import Journal
from hvcpd.memory.store import Store
from hvcpd.people.enrolled import Person
from hvcpd.ports import STANDSTILL, Samples
from hvcpd.recognition.events import Event, Garbled, Recognised, Source
from hvcpd.robot.records import GarbledRecord, HeardRecord, SaidRecord, VoiceRecord
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.synthesis.voices import voice_for
from tests.robot.test_hold import ScriptedEars

BLOCK = np.zeros(400, np.float32)


class Told(ScriptedEars):
    """A recogniser that reports one sentence in one voice."""

    def __init__(self, words: str, voice: str) -> None:
        super().__init__()
        self.event: Recognised | Garbled = Recognised(tuple(words.split()), voice, 0, 400, 0.99, 20.0, ())

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        return [self.event]


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


def plan(tasks: TaskRepository) -> RobotPlan:
    """Rob's, who is told of Bot, a robot, and of Anna, who is enrolled."""
    people = {"anna": Person("Anna", {"stop": [np.ones((20, 24), np.float32)]})}
    team, hearing = TeamPlan(("Rob", "Bot", "Anna")), HearingPlan(people=people)
    return RobotPlan(Role("Rob", "plant"), team, tasks, 1, hearing=hearing)


@pytest.mark.parametrize(
    ("words", "voice", "other"),
    [
        ("hi rob i am bot i am free", voice_for("Bot").name, False),
        ("hi rob i am bot i am free", "stranger", True),
        ("hi rob i am bot i am free", "anna, enrolled", True),
        ("hi rob i am anna what is left", "anna, enrolled", False),
        ("hi rob i am anna what is left", voice_for("Bot").name, True),
        ("who is here", "stranger", False),
    ],
)
def test_a_name_in_another_voice_is_noted(sound: Sound, words: str, voice: str, other: bool) -> None:
    tasks = load_tasks(default_tasks_path())
    robot = make_robot(plan(tasks), sound)
    robot._recogniser = Told(words, voice)  # type: ignore[assignment]
    records = robot.step(BLOCK, None).records
    assert any(isinstance(r, HeardRecord) for r in records)
    noted = [r for r in records if isinstance(r, VoiceRecord)]
    assert bool(noted) == other
    store = Store()
    Journal(store, tasks, "Rob").write(records, 0.0)
    texts = [row.text for row in store.transcript() if row.kind == "garbled"]
    assert texts == [f"another voice than {r.speaker}'s: {r.voice}, not {r.expected}" for r in noted]


@pytest.mark.parametrize(("source", "is_person"), [(Source.PEOPLE, True), (Source.CHANNEL, False)])
def test_who_is_heard_in_no_robots_voice_is_a_person(sound: Sound, source: Source, is_person: bool) -> None:
    robot = make_robot(plan(load_tasks(default_tasks_path())), sound)
    told = Told("hi rob i am anna what is left", "anna, enrolled")
    told.event = replace(told.event, source=source)
    robot._recogniser = told  # type: ignore[assignment]
    robot.step(BLOCK, None)
    assert robot.coordination.peers.people() == ({"anna"} if is_person else set())


class Repeated(Told):
    """A recogniser that reports it every two seconds, as just said."""

    n = 0

    def lost(self, n_samples: int) -> list[Event]:
        self.n += n_samples
        return []

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        self.n += len(samples)
        return [replace(self.event, start_sample=self.n - 8_000, end_sample=self.n)] if self.n % 32_000 == 0 else []


def test_speech_for_it_by_name_is_answered_although_it_is_not_clear(sound: Sound) -> None:
    robot = make_robot(plan(load_tasks(default_tasks_path())), sound)
    for addressed in (False, True):
        unclear = Repeated("", "")
        unclear.event = Garbled(0, 400, addressed=addressed)
        robot._recogniser = unclear  # type: ignore[assignment]
        records = [record for _ in range(800) for record in robot.step(BLOCK, None).records]
        assert [r.addressed for r in records if isinstance(r, GarbledRecord)] == [addressed] * 10
        said = [r for r in records if isinstance(r, SaidRecord) and isinstance(r.utterance.statement, NotUnderstood)]
        assert bool(said) == addressed


def test_torn_sound_tells_nothing_of_who_has_whose_voice_or_name(sound: Sound) -> None:
    tasks = load_tasks(default_tasks_path())
    robot = make_robot(plan(tasks), sound)
    robot._recogniser = Repeated("hi bot i am rob i am free", "stranger")  # type: ignore[assignment]

    def lives(disturbed: bool, speaks: bool) -> tuple[int, int, int]:
        heard = others = taken = 0
        for _ in range(800):
            if disturbed:
                robot.disturb()
            if speaks:
                robot._voice.until_s = robot.now
            for record in robot.step(BLOCK, None).records:
                heard += isinstance(record, HeardRecord)
                others += isinstance(record, VoiceRecord)
                taken += isinstance(record, SaidRecord) and isinstance(record.utterance.statement, NameTaken)
        return heard, others, taken

    assert lives(disturbed=True, speaks=True) == (10, 0, 0), "they may be its own words"
    assert lives(disturbed=False, speaks=False) == (10, 10, 1)


def test_a_name_that_is_taken_is_told_also_on_a_busy_computer(sound: Sound) -> None:
    """Where each sentence disturbed the sound at its beginning, two robots called Rob never noticed each other."""
    robot = make_robot(plan(load_tasks(default_tasks_path())), sound)
    robot._recogniser = Repeated("hi bot i am rob i am free", "stranger")  # type: ignore[assignment]
    taken = 0
    for _ in range(1000):
        robot.disturb()
        said = [record for record in robot.step(BLOCK, None).records if isinstance(record, SaidRecord)]
        taken += sum(isinstance(record.utterance.statement, NameTaken) for record in said)
    assert taken == 1


def test_a_sentence_with_a_gap_in_it_tells_nothing_of_a_voice(sound: Sound) -> None:
    tasks = load_tasks(default_tasks_path())
    robot = make_robot(plan(tasks), sound)
    robot._recogniser = Repeated("hi rob i am bot i am free", "stranger")  # type: ignore[assignment]
    for _ in range(79):
        robot.step(BLOCK, None)
    records = robot.step(BLOCK, None, lost=0).records
    assert any(isinstance(r, HeardRecord) for r in records)
    assert not any(isinstance(r, VoiceRecord) for r in records)


class Once(Told):
    """A recogniser that reports it once."""

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        told, self.event = self.event, None  # type: ignore[assignment]
        return [told] if told is not None else []


KEYS = KeyRing(TeamKey(bytes(KEY_BYTES)))


@pytest.mark.parametrize(("voice", "keys"), [("stranger", None), ("stranger", KEYS), ("anna, enrolled", KEYS)])
def test_where_the_team_has_a_key_no_voice_alone_sets_wheels_in_motion(
    sound: Sound, voice: str, keys: KeyRing | None
) -> None:
    """Neither a stranger's nor an enrolled one: a recording has that too. "Stop" is obeyed from anybody."""
    role, names = Role("Rob", "plant"), ("Rob", "Bot", "Anna")
    plan = RobotPlan(role, TeamPlan(names, names[:2]), load_tasks(default_tasks_path()), 1, security=SecurityPlan(keys))
    robot = make_robot(plan, sound)
    robot._recogniser = Once("bot stop", voice)  # type: ignore[assignment]
    while robot.coordination.state is not State.READY:
        robot.step(BLOCK, None)
    robot._recogniser = Once("rob move forward one metre", voice)  # type: ignore[assignment]
    outputs, states = [], set()
    for _ in range(240):
        outputs.append(robot.step(BLOCK, None))
        states.add(robot.coordination.state)
    said = {r.text for out in outputs for r in out.records if isinstance(r, SaidRecord)}
    trusted = keys is None
    assert (State.MOVING in states) == trusted
    assert trusted or all(out.wheels == STANDSTILL for out in outputs)
    assert ("Hi all, I am Rob, I do not trust that" in said) != trusted
    robot._recogniser = Once("rob stop", voice)  # type: ignore[assignment]
    robot.step(BLOCK, None)
    assert robot.coordination.state is State.STOPPED
