"""What a robot reads back and the person confirms, is learned; nothing else is."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hvcpd.daemon.adaptation import CONFIRMED_S, LEAST, Adaptation, ConfirmedSentences
from hvcpd.daemon.second_pass import SecondPass
from hvcpd.language.messages import (
    Busy,
    Claim,
    Confirmed,
    Distrusted,
    Negative,
    Order,
    SayAgain,
    Statement,
    TaskByNumber,
    ToAll,
    ToRobot,
    ToTeam,
    TurnBy,
    Unknown,
    Utterance,
    WillMove,
)
from hvcpd.memory.people import person_path, read_person, remove_person, write_person
from hvcpd.people.enrolled import STRANGER, Person, SpokenSentence
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.frontend import N_BANDS
from hvcpd.recognition.stages import Segment
from hvcpd.robot.records import HeardRecord, Record, SaidRecord
from tests.permissions import bound, needs_permissions
from tests.recognition.signals import word

ORDER = Utterance("Anna", ToRobot("Rob"), statement=Order(TaskByNumber(3)))
READ_BACK = Utterance("Rob", ToRobot("Anna"), statement=Claim(TaskByNumber(3)))
YES = Utterance("Anna", ToRobot("Rob"), statement=Confirmed(None, False))
ORIGIN = 160_000


def piece_of(*words: str) -> tuple[Segment, Recognised]:
    """Words after half a second of noise, in a clock in which they begin at ORIGIN."""
    lead = SAMPLE_RATE_HZ // 2
    parts, spans, at = [np.zeros(lead, np.float32)], [], ORIGIN + lead
    for name in words:
        sound = word(name)
        spans.append(WordSpan(name, at, at + len(sound), 0.9))
        parts.append(sound)
        at += len(sound)
    sound = np.concatenate([*parts, np.zeros(lead, np.float32)])
    sound = np.asarray(sound + 1e-4 * np.random.default_rng(1).standard_normal(len(sound)), np.float32)
    sentence = Recognised(words, "stranger", spans[0].start_sample, at, 0.9, 30.0, tuple(spans))
    return Segment(sound, lead, ORIGIN + lead, at), sentence


START_S = (ORIGIN + SAMPLE_RATE_HZ // 2) / SAMPLE_RATE_HZ


def learn(
    read_back: Utterance | None = READ_BACK,
    confirmed_s: float = START_S + 8.0,
    yes: Utterance = YES,
    order: Utterance = ORDER,
    **of: Any,
) -> tuple[str, SpokenSentence] | None:
    learning = ConfirmedSentences("Rob")
    segment, sentence = piece_of("water", "rose")
    learning.found(replace(segment, **of), sentence)
    assert learning.heard(order, START_S, START_S + 2.0) is None
    if read_back is not None:
        learning.said(read_back)
    return learning.heard(yes, confirmed_s - 1.0, confirmed_s)


def test_what_was_read_back_and_confirmed_is_learned_once() -> None:
    learned = learn()
    assert learned is not None
    assert learned[0] == "Anna"
    assert learned[1].words == ("water", "rose")
    assert len(learned[1].logs) > 40


@pytest.mark.parametrize(
    "wrong",
    [
        {"read_back": None},
        {"read_back": replace(READ_BACK, addressee=ToAll())},
        {"read_back": replace(READ_BACK, addressee=ToRobot("Bot"))},
        {"confirmed_s": START_S + CONFIRMED_S + 3.0},
        {"yes": replace(YES, speaker="Bot")},
        {"yes": replace(YES, speaker=None)},
        {"yes": replace(YES, speaker="Rob")},
        {"yes": ORDER},
        {"later": (1,)},
    ],
)
def test_nothing_is_learned_of_what_was_not_read_back_or_not_confirmed(wrong: dict[str, object]) -> None:
    assert learn(**wrong) is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "answer",
    [Busy(), Distrusted(), SayAgain(), Unknown(TaskByNumber(3)), Claim(TaskByNumber(2)), WillMove(TurnBy(90.0))],
)
def test_another_answer_is_no_read_back(answer: Statement) -> None:
    """Whatever a robot said to Anna, even "I do not trust that", counted as a read-back, and misheard words as hers."""
    assert learn(replace(READ_BACK, statement=answer)) is None


def test_a_motion_that_was_read_back_and_confirmed_is_learned() -> None:
    order, read_back = (replace(each, statement=TurnBy(90.0)) for each in (ORDER, READ_BACK))
    assert learn(replace(read_back, statement=WillMove(TurnBy(90.0))), order=order) is not None
    assert learn(replace(read_back, statement=WillMove(TurnBy(-90.0))), order=order) is None


def test_nobody_is_learned_under_the_name_of_all_whose_names_are_not_known() -> None:
    order, yes = (replace(each, speaker="friend") for each in (ORDER, YES))
    assert learn(replace(READ_BACK, addressee=ToRobot("friend")), yes=yes, order=order) is None


@pytest.mark.parametrize("statement", [Negative(), Order(TaskByNumber(2))])
def test_what_may_have_been_denied_without_a_name_is_not_learned(statement: Statement) -> None:
    """Her confirmation of what was ordered instead would have confirmed the words that were misheard."""
    learning = ConfirmedSentences("Rob")
    learning.found(*piece_of("water", "rose"))
    learning.heard(ORDER, START_S, START_S + 2.0)
    learning.said(READ_BACK)
    learning.heard(replace(YES, speaker="friend", statement=statement), START_S + 4.0, START_S + 5.0)
    assert learning.heard(YES, START_S + 10.0, START_S + 11.0) is None


def test_others_may_speak_between_a_sentence_and_its_confirmation() -> None:
    learning = ConfirmedSentences("Rob")
    learning.found(*piece_of("water", "rose"))
    learning.heard(ORDER, START_S, START_S + 2.0)
    learning.said(READ_BACK)
    assert learning.heard(replace(YES, speaker="Bot"), START_S + 4.0, START_S + 5.0) is None
    assert learning.heard(YES, START_S + 7.0, START_S + 8.0) is not None


def confirm(
    people: dict[str, Person],
    state_dir: Path,
    times: int = 1,
    voice: str = STRANGER,
    others: tuple[Record, ...] = (),
    robots: tuple[str, ...] = (),
) -> list[Person]:
    """A daemon that knows these people hears Anna confirm orders; of whom it learns more."""
    learned: list[Person] = []

    class Found(SecondPass[Segment, Recognised | None]):
        def take_sentences(self) -> list[tuple[Segment, Recognised | None]]:
            return [piece_of("water", "rose")]

    async def live() -> None:
        second = Found(None)
        adaptation = Adaptation("Rob", people, learned.append, state_dir, second, robots)
        adaptation.take(others)
        for _ in range(times):
            adaptation.take([record_of(ORDER, START_S, START_S + 2.0, voice)])
            adaptation.take([SaidRecord(START_S + 3.0, READ_BACK, "", 1.0)])
            adaptation.take([record_of(YES, START_S + 7.0, START_S + 8.0, voice)])
        await adaptation.settled()
        await second.close()

    asyncio.run(live())
    return learned


def record_of(utterance: Utterance, start_s: float, at_s: float, voice: str = STRANGER) -> HeardRecord:
    return HeardRecord(at_s, utterance, "", start_s, at_s, 0.9, 20.0, voice)


def known_by(*words: str) -> Person:
    return Person("Anna", {word: [np.ones((10, N_BANDS), np.float32)] for word in words})


def test_what_enrolled_people_confirm_counts_at_once(tmp_path: Path) -> None:
    anna, path = known_by("stop"), person_path(tmp_path, "Anna")
    write_person(path, anna)
    (learned,) = confirm({"anna": anna}, tmp_path)
    assert [each.words for each in learned.sentences] == [("water", "rose")]
    assert [each.words for each in read_person(path).sentences] == [("water", "rose")]
    assert read_person(path).takes.keys() == {"stop"}
    assert anna.sentences == ()


def test_who_has_confirmed_three_sentences_is_enrolled(tmp_path: Path) -> None:
    path = person_path(tmp_path, "Anna")
    assert confirm({}, tmp_path, LEAST - 1) == []
    assert not path.exists()
    assert confirm({}, tmp_path, LEAST) == []  # from the next start on
    assert len(read_person(path).sentences) == LEAST


def test_somebody_who_was_enrolled_meanwhile_keeps_the_takes(tmp_path: Path) -> None:
    write_person(person_path(tmp_path, "Anna"), known_by("stop"))
    confirm({}, tmp_path, LEAST)
    person = read_person(person_path(tmp_path, "Anna"))
    assert person.takes.keys() == {"stop"}
    assert len(person.sentences) == LEAST


def test_a_robot_is_never_enrolled(tmp_path: Path) -> None:
    confirm({}, tmp_path, 2 * LEAST, "oak")
    assert not person_path(tmp_path, "Anna").exists()
    for robot in (Utterance("Anna", ToAll()), "oak"), (Utterance("Anna", ToTeam("plant")), STRANGER):
        confirm({}, tmp_path, 2 * LEAST, others=(record_of(robot[0], 1.0, 2.0, robot[1]),))
    confirm({}, tmp_path, 2 * LEAST, robots=("Anna",))  # heard before this start
    assert not person_path(tmp_path, "Anna").exists()


def test_who_was_once_heard_in_an_enrolled_persons_voice_is_no_robot(tmp_path: Path) -> None:
    """A person's takes fitted another one's greeting, who was taken for a robot until the next start."""
    greeting = record_of(Utterance("Anna", ToAll()), 1.0, 2.0, "ben, enrolled")
    confirm({}, tmp_path, LEAST, others=(greeting,))
    assert person_path(tmp_path, "Anna").exists()


@needs_permissions
def test_what_may_not_be_looked_at_is_told(tmp_path: Path) -> None:
    """The daemon had an exception that nobody retrieved, and logged nothing that a user understands."""
    (tmp_path / "people").mkdir(mode=0o000)
    name = Path(__file__).stem
    program = f"from pathlib import Path; from tests.daemon.{name} import *; confirm({{}}, Path('{tmp_path}'), LEAST)"
    ran = bound("-c", program)
    assert ran.returncode == 0, ran.stderr
    assert "voice not learned" in ran.stdout


def test_what_was_enrolled_or_removed_meanwhile_is_left_so(tmp_path: Path) -> None:
    path, anna = person_path(tmp_path, "Anna"), known_by("stop")
    write_person(path, known_by("stop", "rob"))
    confirm({"anna": anna}, tmp_path)
    assert read_person(path).takes.keys() == {"stop", "rob"}
    assert len(read_person(path).sentences) == 1
    remove_person(path)
    confirm({"anna": anna}, tmp_path)
    assert not path.exists()
