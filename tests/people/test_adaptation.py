"""What is said again when it was asked for, and confirmed, becomes takes; nothing else does."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hvcpd.daemon.adaptation import Adaptation
from hvcpd.daemon.second_pass import SecondPass
from hvcpd.language.messages import Confirmed, SayAgain, ToRobot, Utterance, WhatLeft
from hvcpd.people.enrolled import Person, person_path, read_person, remove_person, write_person
from hvcpd.people.takes import ASKED_S, CONFIRMED_S, ConfirmedTakes, distance, features, words_in
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.second_pass import Segment
from hvcpd.robot.records import HeardRecord, Record, SaidRecord
from tests.recognition.signals import word

ASK = Utterance("Rob", ToRobot("Anna"), statement=SayAgain(False))
QUESTION = Utterance("Anna", ToRobot("Rob"), statement=WhatLeft())
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
    return Segment(sound, lead, ORIGIN + lead, at, ORIGIN), sentence


START_S = (ORIGIN + SAMPLE_RATE_HZ // 2) / SAMPLE_RATE_HZ


def test_words_are_cut_out_of_a_sentence() -> None:
    takes = words_in(*piece_of("water", "green", "rose"))
    assert sorted(takes) == ["green", "rose", "water"]
    alone = words_in(*piece_of("green"))["green"][0]
    cut = features(takes["green"][0])
    assert distance(cut, features(alone)) < 0.6 * distance(cut, features(takes["rose"][0]))


def learn(asked_s: float = START_S - 3.0, confirmed_s: float = START_S + 8.0, yes: Utterance = YES) -> object:
    learning = ConfirmedTakes("Rob")
    learning.said(ASK, asked_s)
    learning.found(*piece_of("water", "rose"))
    assert learning.heard(QUESTION, START_S, START_S + 2.0) is None
    return learning.heard(yes, confirmed_s - 1.0, confirmed_s)


def test_what_was_asked_for_again_and_confirmed_is_learned_once() -> None:
    learned = learn()
    assert isinstance(learned, tuple)
    name, takes = learned
    assert name == "Anna"
    assert sorted(takes) == ["rose", "water"]


@pytest.mark.parametrize(
    "wrong",
    [
        {"asked_s": START_S - ASKED_S - 1.0},
        {"confirmed_s": START_S + CONFIRMED_S + 3.0},
        {"yes": replace(YES, speaker="Bot")},
        {"yes": replace(YES, speaker=None)},
        {"yes": replace(YES, speaker="Rob")},
    ],
)
def test_nothing_is_learned_of_what_was_not_asked_for_or_not_confirmed(wrong: dict[str, object]) -> None:
    assert learn(**wrong) is None  # type: ignore[arg-type]


def confirm(people: dict[str, Person], state_dir: Path) -> list[Person]:
    """A daemon that knows these people hears Anna confirm two words; of whom it learns more."""
    learned: list[Person] = []

    class Found(SecondPass[Segment, Recognised | None]):
        def take_sentences(self) -> list[tuple[Segment, Recognised | None]]:
            return [piece_of("water", "rose")]

    def heard(utterance: Utterance, start_s: float, at_s: float) -> HeardRecord:
        return HeardRecord(at_s, utterance, "", start_s, at_s, 0.9, 20.0, "stranger")

    async def live(records: list[Record]) -> None:
        second = Found(None)
        adaptation = Adaptation("Rob", people, learned.append, state_dir, second)
        for record in records:
            adaptation.take([record])
        await adaptation.settled()
        await second.close()

    records: list[Record] = [
        SaidRecord(START_S - 3.0, ASK, "", 1.0),
        heard(QUESTION, START_S, START_S + 2.0),
        heard(YES, START_S + 7.0, START_S + 8.0),
    ]
    asyncio.run(live(records))
    return learned


def test_the_daemon_keeps_what_enrolled_people_confirm(tmp_path: Path) -> None:
    anna = Person("Anna", words_in(*piece_of("stop")))
    write_person(person_path(tmp_path, "Anna"), anna)
    assert confirm({}, tmp_path) == []
    assert read_person(person_path(tmp_path, "Anna")).words == {"stop"}
    (learned,) = confirm({"anna": anna}, tmp_path)
    assert read_person(person_path(tmp_path, "Anna")).words == {"stop", "water", "rose"}
    assert learned.words == {"stop", "water", "rose"}  # known to the second look at once
    assert anna.words == {"stop"}


def test_what_was_enrolled_or_removed_meanwhile_is_left_so(tmp_path: Path) -> None:
    path, anna = person_path(tmp_path, "Anna"), Person("Anna", words_in(*piece_of("stop")))
    write_person(path, anna.with_takes(words_in(*piece_of("rob"))))
    confirm({"anna": anna}, tmp_path)
    assert read_person(path).words == {"stop", "rob", "water", "rose"}
    remove_person(path)
    confirm({"anna": anna}, tmp_path)
    assert not path.exists()
