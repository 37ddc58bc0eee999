"""Encrypted statements: only whoever has the key reads them, once, and nobody makes or changes one without."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.security.cipher import TAG_BYTES, Ciphers, Message
from hvcpd.security.guard import FAR, NEAR, PRESENT_S, Guard
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.security.seal import Sentence
from hvcpd.security.silence import Patience
from hvcpd.security.trust import Trust

KEY, NEXT_KEY = TeamKey(bytes(KEY_BYTES)), TeamKey(bytes([1] * KEY_BYTES))
RING = KeyRing(KEY)
CALM = Patience(free=1e9)
TO_BOT = Sentence("Rob", "Bot", ("hi", "bot", "i", "am", "rob", "sealed", "message", "digest"))
TO_ROB = Sentence("Bot", "Rob", ("hi", "rob", "i", "am", "bot", "sealed", "message", "digest"))
N_BYTES = 2 + TAG_BYTES


def pair() -> tuple[Guard, Guard]:
    return Guard("Rob", RING, patience=CALM), Guard("Bot", RING, patience=CALM)


def said(guard: Guard, plain: bytes, now: float = 0.0, sentence: Sentence = TO_BOT, asks: bool = False) -> Message:
    return Message(sentence, guard.encrypt(sentence, plain, now, asks), N_BYTES)


def trust(guard: Guard, message: Message, now: float = 0.0) -> Trust:
    return guard.judge_message(message, now).trust


@given(st.binary(min_size=2, max_size=2), st.integers(0, 1000), st.integers(0, 2**48 - 1) | st.none())
def test_what_is_encrypted_is_read_under_its_number_only(plain: bytes, counter: int, challenge: int | None) -> None:
    ciphers = Ciphers(KEY.cipher_key("Rob"), TO_BOT, challenge)
    message = Message(TO_BOT, ciphers.at(counter, plain), N_BYTES)
    assert ciphers.find(message, range(counter - 3, counter + 3) if counter > 2 else range(6)) == (counter, plain)
    assert ciphers.find(message, range(counter + 1, counter + 9)) is None


def test_the_same_statement_is_never_said_in_the_same_words() -> None:
    rob, _ = pair()
    assert len({said(rob, b"\0\1").packet for _ in range(200)}) == 200


def test_a_message_is_taken_once_and_read() -> None:
    rob, bot = pair()
    message = said(rob, b"\1\2")
    verdict = bot.judge_message(message, 0.0)
    assert (verdict.trust, verdict.plain) == (Trust.SEALED, b"\1\2")
    assert trust(bot, message, 1.0) is Trust.USED
    again = Guard("Bot", RING, bot.saves(), patience=CALM)
    assert trust(again, message, 2.0) is Trust.USED


def test_every_wrong_bit_is_noticed() -> None:
    rob, bot = pair()
    message = said(rob, b"\1\2")
    for bit in range(60):
        verdict = bot.judge_message(replace(message, packet=message.packet ^ 1 << bit), 0.0)
        assert (verdict.trust, verdict.plain) == (Trust.WRONG, None)


@pytest.mark.parametrize(
    "other",
    [
        replace(TO_BOT, speaker="Zoe"),
        replace(TO_BOT, addressee="Max"),
        replace(TO_BOT, words=(*TO_BOT.words[:-1], "x")),
    ],
)
def test_a_message_is_of_one_speaker_one_addressee_and_one_phrasebook(other: Sentence) -> None:
    rob, bot = pair()
    message = said(rob, b"\1\2")
    assert trust(bot, replace(message, sentence=other)) is Trust.WRONG
    assert trust(bot, message) is Trust.SEALED


def test_another_team_reads_nothing() -> None:
    rob, _ = pair()
    stranger = Guard("Bot", KeyRing(NEXT_KEY), patience=CALM)
    assert stranger.judge_message(said(rob, b"\1\2"), 0.0).plain is None


def test_messages_and_seals_share_their_numbers_and_not_their_keys() -> None:
    rob, bot = pair()
    first, second = said(rob, b"\0\0"), rob.seal(TO_BOT, 0.0)
    assert bot.judge(TO_BOT, second, None, 0.0).trust is Trust.SEALED
    assert trust(bot, first) is Trust.USED
    assert KEY.cipher_key("Rob") != KEY.voice_key("Rob")[:KEY_BYTES]


def test_presence_is_proved_by_an_encrypted_answer() -> None:
    rob, bot = pair()
    assert trust(bot, said(rob, b"\1\1")) is Trust.SEALED
    asked = said(bot, b"\0\7", 1.0, TO_ROB, asks=True)
    verdict = rob.judge_message(asked, 1.0)
    rob.challenged(asked.sentence, asked.packet, verdict, 1.0)
    assert trust(bot, said(rob, b"\1\1", 2.0), 3.0) is Trust.FRESH
    assert trust(bot, said(rob, b"\1\2", 9.0), 9.0) is Trust.FRESH
    assert trust(bot, said(rob, b"\1\2", 9.0), 10.0 + PRESENT_S) is Trust.SEALED


@pytest.mark.parametrize(("lost", "first"), [(NEAR - 1, Trust.SEALED), (NEAR, Trust.AHEAD), (FAR - 2, Trust.AHEAD)])
def test_who_missed_many_is_brought_back_by_two_in_a_row(lost: int, first: Trust) -> None:
    rob, bot = pair()
    for _ in range(lost):
        rob.seal(TO_BOT, 0.0)
    verdict = bot.judge_message(said(rob, b"\3\4"), 0.0)
    assert (verdict.trust, verdict.plain) == (first, b"\3\4")
    assert trust(bot, said(rob, b"\3\4")) is Trust.SEALED


def test_messages_of_two_keys_are_read_while_both_count_and_of_who_is_revoked_none() -> None:
    rob = Guard("Rob", KeyRing(NEXT_KEY), patience=CALM)
    bot = Guard("Bot", KeyRing(KEY, (NEXT_KEY,)), patience=CALM)
    assert trust(bot, said(rob, b"\1\1")) is Trust.SEALED
    strict = Guard("Bot", KeyRing(NEXT_KEY, revoked=frozenset({"rob"})), patience=CALM)
    assert trust(strict, said(rob, b"\1\1")) is Trust.REVOKED


def test_wrong_messages_bring_silence() -> None:
    rob, _ = pair()
    bot = Guard("Bot", RING)
    wrong = replace(said(rob, b"\1\1"), packet=5)
    verdicts = [bot.judge_message(wrong, 0.0) for _ in range(6)]
    assert [v.trust for v in verdicts][-1] is Trust.SILENCED
    assert trust(bot, said(rob, b"\1\1"), 1.0) is Trust.SILENCED
