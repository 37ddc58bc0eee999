"""What a robot that encrypts says to whom, and what others make of it."""

from __future__ import annotations

import pytest

from hil_fakes.word_seals import keyed_book
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.robot.records import DoubtRecord
from hvcpd.robot.sealing import Sealing, written
from hvcpd.security.guard import Guard
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.security.trust import Trust
from tests.coordination.mission import plants

RING = KeyRing(TeamKey(bytes(KEY_BYTES)))
NAMES = ("Rob", "Bot")
BOOK = keyed_book((*NAMES, "Ann"), plants(3))
CLAIM = m.Claim(m.TaskByNumber(2))


def robot(name: str, encrypts: bool = True) -> Sealing:
    return Sealing(Guard(name, RING), encrypts, NAMES)


def on_air(said: m.Utterance, book: Phrasebook = BOOK) -> m.Utterance:
    """As its words are understood by whoever hears them."""
    return book.parse(book.render(said))


@pytest.mark.parametrize("to", [m.ToAll(), m.ToTeam("plant"), m.ToRobot("Bot")])
@pytest.mark.parametrize(
    "statement", [CLAIM, m.Relayed("Ann", CLAIM), m.Free(), m.WhatLeft(), m.WillMove(m.ComeBack())]
)
def test_what_robots_tell_each_other_is_hidden_and_understood(to: m.Addressee, statement: m.Statement) -> None:
    said = robot("Rob").marked(m.Utterance("Rob", to, None, statement), BOOK, 0.0)
    heard = on_air(said)
    assert isinstance(heard.mark, m.Cipher)
    assert heard.statement in (m.SealedMessage(), m.Relayed("Ann", m.SealedMessage()))
    judged = robot("Bot", encrypts=False).heard(heard, BOOK, 1.0)
    assert (judged.utterance, judged.trust) == (said, Trust.SEALED)
    assert written(judged.utterance, BOOK) == BOOK.write(m.Utterance("Rob", to, None, statement))


@pytest.mark.parametrize("statement", [None, m.Stop(), m.Spelled("rob"), m.Distrusted()])
def test_greetings_stop_names_and_distrust_are_never_hidden(statement: m.Statement | None) -> None:
    said = m.Utterance("Rob", m.ToAll(), None, statement)
    assert robot("Rob").marked(said, BOOK, 0.0).mark is None


@pytest.mark.parametrize(("name", "roster"), [("Ann", NAMES), ("friend", NAMES), ("friend", ())])
def test_people_are_answered_plainly(name: str, roster: tuple[str, ...]) -> None:
    rob = Sealing(Guard("Rob", RING), True, roster)
    said = rob.marked(m.Utterance("Rob", m.ToRobot(name), None, CLAIM), BOOK, 0.0)
    assert isinstance(said.mark, m.Seal)
    assert "i will complete task two" in " ".join(BOOK.render(said))


def test_with_another_task_file_a_message_is_refused_and_not_misread() -> None:
    other = keyed_book((*NAMES, "Ann"), plants(4))
    said = robot("Rob").marked(m.Utterance("Rob", m.ToAll(), None, CLAIM), BOOK, 0.0)
    judged = robot("Bot").heard(on_air(said, other), other, 1.0)
    assert (judged.trust, judged.utterance.statement) == (Trust.WRONG, m.SealedMessage())
    [doubt] = [record for record in judged.records if isinstance(record, DoubtRecord)]
    assert doubt.text == "Hi all, I am Rob, sealed message"


def test_a_request_to_say_again_is_a_challenge_when_it_is_hidden() -> None:
    rob, bot = robot("Rob"), robot("Bot")
    order = m.Utterance("Rob", m.ToRobot("Bot"), None, m.TurnBy(90.0))
    assert bot.heard(on_air(rob.marked(order, BOOK, 0.0)), BOOK, 1.0).trust is Trust.SEALED
    asked = bot.marked(m.Utterance("Bot", m.ToRobot("Rob"), None, m.SayAgain()), BOOK, 2.0)
    assert rob.heard(on_air(asked), BOOK, 3.0).utterance.statement == m.SayAgain()
    assert bot.heard(on_air(rob.marked(order, BOOK, 4.0)), BOOK, 5.0).trust is Trust.FRESH
