"""The guard: counters, windows, challenges, rotation, revocation, silence. Each attack has a test of its own kind."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from hvcpd.security.guard import CHALLENGE_S, FAR, NEAR, PRESENT_S, PROVED_S, Guard
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.security.one_time import STEP_S, counted_code, step_of
from hvcpd.security.seal import Sentence
from hvcpd.security.silence import GrowingSilence, Patience
from hvcpd.security.trust import Trust

KEY, NEXT_KEY = TeamKey(bytes(KEY_BYTES)), TeamKey(bytes([1] * KEY_BYTES))
RING = KeyRing(KEY)
CALM = Patience(free=1e9)
"""Never silent, so that a test sees what the seals alone keep out."""
WALL_S = 1_800_000_000.0


def said(text: str = "confirmed", speaker: str = "Rob", to: str = "Bot") -> Sentence:
    return Sentence(speaker, to, (*f"hi {to} i am {speaker}".lower().split(), *text.split()))


AGAIN = said("say again", "Bot", "Rob")


def pair(bits: int = 24) -> tuple[Guard, Guard]:
    return Guard("Rob", RING, bits=bits, patience=CALM), Guard("Bot", RING, bits=bits, patience=CALM)


def trust(guard: Guard, sentence: Sentence, seal: int, now: float = 0.0) -> Trust:
    return guard.judge(sentence, seal, None, now).trust


def test_a_seal_is_taken_once() -> None:
    rob, bot = pair()
    seal = rob.seal(said(), 0.0)
    assert trust(bot, said(), seal) is Trust.SEALED
    assert trust(bot, said(), seal, 1.0) is Trust.USED
    assert trust(bot, said(), seal, 86_400.0) is Trust.USED


def test_a_recording_is_known_after_a_restart() -> None:
    rob, bot = pair()
    seals = [rob.seal(said(), 0.0) for _ in range(5)]
    assert trust(bot, said(), seals[4]) is Trust.SEALED
    again = Guard("Bot", RING, bot.saves(), patience=CALM)
    assert {trust(again, said(), seal) for seal in seals} == {Trust.USED}
    assert trust(again, said(), rob.seal(said(), 9.0)) is Trust.SEALED


@pytest.mark.parametrize(
    "other", [said("negative"), said(speaker="Zoe"), said(to="Max"), replace(said(), words=said().words[:-1])]
)
def test_a_seal_is_of_one_sentence(other: Sentence) -> None:
    rob, bot = pair()
    seal = rob.seal(said(), 0.0)
    assert trust(bot, other, seal) is Trust.WRONG
    assert trust(bot, said(), seal) is Trust.SEALED


def test_every_wrong_bit_is_noticed() -> None:
    rob, bot = pair()
    seal = rob.seal(said(), 0.0)
    assert {trust(bot, said(), seal ^ (1 << bit)) for bit in range(24)} == {Trust.WRONG}


@pytest.mark.parametrize("lost", [0, 1, NEAR - 1])
def test_lost_sentences_cost_nothing_within_the_window(lost: int) -> None:
    rob, bot = pair()
    for _ in range(lost):
        rob.seal(said(), 0.0)
    assert trust(bot, said(), rob.seal(said(), 0.0)) is Trust.SEALED


@pytest.mark.parametrize("lost", [NEAR, 300, FAR - 3])
def test_who_was_away_takes_the_second_of_two(lost: int) -> None:
    rob, bot = pair()
    for _ in range(lost):
        rob.seal(said(), 0.0)
    assert trust(bot, said(), rob.seal(said(), 0.0)) is Trust.AHEAD
    assert trust(bot, said(), rob.seal(said(), 0.0)) is Trust.SEALED


def test_far_ahead_the_same_seal_twice_is_not_two() -> None:
    rob, bot = pair()
    for _ in range(100):
        rob.seal(said(), 0.0)
    seal = rob.seal(said(), 0.0)
    assert [trust(bot, said(), seal) for _ in range(3)] == [Trust.AHEAD] * 3


def test_beyond_the_farthest_nothing_is_taken() -> None:
    rob, bot = pair()
    for _ in range(FAR + 5):
        rob.seal(said(), 0.0)
    assert {trust(bot, said(), rob.seal(said(), 0.0)) for _ in range(3)} == {Trust.WRONG}


def test_an_answer_to_a_challenge_proves_presence_and_a_recording_does_not() -> None:
    rob, bot = pair()
    missed = rob.seal(said("move forward one metre"), 0.0)
    assert trust(bot, said("move forward one metre"), missed) is Trust.SEALED
    challenge = bot.seal(AGAIN, 2.0, challenges=True)
    assert rob.judge(AGAIN, challenge, None, 3.0, asks=True).trust is Trust.SEALED
    answer = rob.seal(said("move forward one metre"), 4.0)
    assert trust(bot, said("move forward one metre"), answer, 6.0) is Trust.FRESH
    later = rob.seal(said("turn left"), 7.0)
    assert trust(bot, said("turn left"), later, PRESENT_S + 5.0) is Trust.FRESH
    late = rob.seal(said("turn left"), 8.0)
    assert trust(bot, said("turn left"), late, 3.0 * PRESENT_S) is Trust.SEALED


def test_orders_that_were_held_back_do_not_keep_their_speaker_here_for_ever() -> None:
    rob, bot = pair()
    for proved_s in (0.0, 2.0 * PROVED_S):
        challenge = bot.seal(AGAIN, proved_s, challenges=True)
        rob.judge(AGAIN, challenge, None, proved_s, asks=True)
        assert trust(bot, said(), rob.seal(said(), proved_s), proved_s) is Trust.FRESH
        played = [
            trust(bot, said("turn left"), rob.seal(said("turn left"), proved_s), proved_s + 0.9 * PRESENT_S * n)
            for n in range(1, 10)
        ]
        assert played == [Trust.FRESH] * 6 + [Trust.SEALED] * 3


def test_an_answer_to_another_challenge_is_none() -> None:
    rob, bot = pair()
    old = bot.seal(AGAIN, 0.0, challenges=True)
    rob.judge(AGAIN, old, None, 1.0, asks=True)
    recorded = rob.seal(said(), 2.0)
    bot.seal(AGAIN, 10.0, challenges=True)
    assert trust(bot, said(), recorded, 12.0) is Trust.WRONG


def test_what_is_said_to_all_answers_the_last_challenge() -> None:
    rob, bot = pair()
    to_all = said("resume", to="all")
    assert trust(bot, to_all, rob.seal(to_all, 0.0)) is Trust.SEALED
    challenge = bot.seal(AGAIN, 2.0, challenges=True)
    rob.judge(AGAIN, challenge, None, 3.0, asks=True)
    assert trust(bot, to_all, rob.seal(to_all, 4.0), 5.0) is Trust.FRESH


def test_a_challenge_does_not_hold_for_ever() -> None:
    rob, bot = pair()
    challenge = bot.seal(AGAIN, 0.0, challenges=True)
    rob.judge(AGAIN, challenge, None, 1.0, asks=True)
    seal = rob.seal(said(), 2.0)
    assert trust(bot, said(), seal, CHALLENGE_S + 1.0) is Trust.WRONG


def test_a_third_robot_follows_an_answer_to_a_challenge_that_it_heard() -> None:
    rob, bot = pair()
    zoe = Guard("Zoe", RING, patience=CALM)
    challenge = bot.seal(AGAIN, 0.0, challenges=True)
    for listener in (rob, zoe):
        assert listener.judge(AGAIN, challenge, None, 1.0, asks=True).trust is Trust.SEALED
    assert trust(zoe, said(), rob.seal(said(), 2.0), 3.0) is Trust.SEALED


def test_the_own_voice_played_back_is_a_recording_and_a_double_is_none() -> None:
    bot = Guard("Bot", RING, patience=CALM)
    own = said("confirmed", "Bot", "Rob")
    seals = [bot.seal(own, 0.0) for _ in range(3)]
    assert {trust(bot, own, seal) for seal in seals} == {Trust.USED}
    double = Guard("Bot", RING, {f"{KEY.fingerprint}/bot": 5}, patience=CALM)
    assert trust(bot, own, double.seal(own, 0.0)) is Trust.SEALED


def test_a_power_cut_repeats_no_seal() -> None:
    rob = Guard("Rob", RING)
    kept: dict[str, int] = {}
    seals = []
    for _ in range(40):
        seals.append(rob.seal(said(), 0.0))
        kept |= rob.saves()
        rob = Guard("Rob", RING, kept)  # cut off after each sentence
    assert len(set(seals)) == 40


def test_a_revoked_voice_is_not_believed_and_others_are() -> None:
    bot = Guard("Bot", replace(RING, revoked=frozenset({"ROB"})))
    rob, zoe = Guard("Rob", RING), Guard("Zoe", RING)
    assert trust(bot, said(), rob.seal(said(), 0.0)) is Trust.REVOKED
    of_zoe = said(speaker="Zoe")
    assert trust(bot, of_zoe, zoe.seal(of_zoe, 0.0)) is Trust.SEALED


def test_two_keys_are_good_while_they_are_changed() -> None:
    rob = Guard("Rob", KeyRing(NEXT_KEY, (KEY,)))
    bot = Guard("Bot", KeyRing(KEY, (NEXT_KEY,)))
    old = Guard("Zoe", RING)
    back = said("negative", "Bot", "Rob")
    assert trust(bot, said(), rob.seal(said(), 0.0)) is Trust.SEALED
    assert trust(rob, back, bot.seal(back, 0.0)) is Trust.SEALED
    assert trust(old, said(), rob.seal(said(), 0.0)) is Trust.WRONG


def test_who_runs_on_while_the_keys_change_speaks_with_the_newest_and_believes_no_ended_one() -> None:
    """Its keys were those of the day on which it was switched on: who was switched on later did not believe it."""
    rob, old = Guard("Rob", KeyRing(KEY, (NEXT_KEY,))), Guard("Bot", RING)
    numbers = [rob.seal(said(), 0.0) for _ in range(3)]
    code = counted_code(KEY.sheet_key, 0)
    rob.set_clock(None, KeyRing(NEXT_KEY))
    new = Guard("Bot", KeyRing(NEXT_KEY))
    assert trust(new, said(), rob.seal(said(), 1.0)) is Trust.SEALED
    back = said(speaker="Bot", to="Rob")
    assert trust(rob, back, old.seal(back, 1.0)) is Trust.WRONG
    assert rob.judge(said(), None, code, 1.0).trust is Trust.WRONG
    rob.set_clock(None, KeyRing(KEY, (NEXT_KEY,)))  # its clock was ahead
    assert rob.judge(said(), None, code, 1.0).trust is Trust.CODE
    assert rob.seal(said(), 2.0) not in numbers, "no number is used twice"
    assert trust(old, said(), rob.seal(said(), 2.0)) is Trust.SEALED


def test_a_code_of_a_key_that_was_not_valid_at_the_start_is_good_later() -> None:
    rob = Guard("Rob", RING, wall_s=WALL_S)
    rob.set_clock(WALL_S, KeyRing(NEXT_KEY, (KEY,)))
    assert rob.judge(said(), None, counted_code(NEXT_KEY.clock_key, step_of(WALL_S)), 0.0).trust is Trust.CODE


def test_a_sentence_without_seal_is_bare() -> None:
    assert Guard("Bot", RING).judge(said(), None, None, 0.0).trust is Trust.BARE


def test_codes_of_the_sheet_are_good_once_and_in_order() -> None:
    bot = Guard("Bot", RING)
    codes = [counted_code(KEY.sheet_key, count) for count in range(40)]
    judged = [bot.judge(said(), None, code, 0.0).trust for code in (codes[0], codes[0], codes[4])]
    assert judged == [Trust.CODE, Trust.WRONG, Trust.CODE]
    again = Guard("Bot", RING, bot.saves())
    assert again.judge(said(), None, codes[3], 0.0).trust is Trust.WRONG
    assert again.judge(said(), None, codes[39], 0.0).trust is Trust.WRONG
    assert again.judge(said(), None, codes[5], 0.0).trust is Trust.CODE


def test_codes_of_the_clock_are_good_once_and_for_a_minute() -> None:
    bot = Guard("Bot", RING, wall_s=WALL_S)
    code = counted_code(KEY.clock_key, int(WALL_S // STEP_S))
    assert bot.judge(said(), None, code, 10.0).trust is Trust.CODE
    assert bot.judge(said(), None, code, 11.0).trust is Trust.WRONG
    assert Guard("Bot", RING, bot.saves(), WALL_S).judge(said(), None, code, 12.0).trust is Trust.WRONG
    assert Guard("Zoe", RING, wall_s=WALL_S).judge(said(), None, code, 100.0).trust is Trust.WRONG
    assert Guard("Max", RING).judge(said(), None, code, 10.0).trust is Trust.WRONG


def test_after_a_code_of_a_clock_that_was_ahead_the_sheet_has_good_ones() -> None:
    ahead = Guard("Bot", RING, wall_s=WALL_S + 86_400.0)
    assert ahead.judge(said(), None, counted_code(KEY.clock_key, step_of(WALL_S + 86_400.0)), 0.0).trust is Trust.CODE
    right = Guard("Bot", RING, ahead.saves(), WALL_S)
    codes = [counted_code(KEY.clock_key, step_of(WALL_S)), counted_code(KEY.sheet_key, 0)]
    assert [right.judge(said(), None, code, 0.0).trust for code in codes] == [Trust.WRONG, Trust.CODE]
    later = counted_code(KEY.clock_key, step_of(WALL_S + 86_500.0))
    assert right.judge(said(), None, later, 86_500.0).trust is Trust.CODE


def test_who_guesses_is_heard_ever_more_rarely() -> None:
    bot = Guard("Bot", RING)
    rng = random.Random(4)
    looked_at = silences = 0
    last_s = 0.0
    for minute in range(24 * 60):
        verdict = bot.judge(said(), rng.getrandbits(24), None, 60.0 * minute)
        looked_at += verdict.trust is not Trust.SILENCED
        if verdict.silence_s is not None:
            silences += 1
            assert verdict.silence_s >= last_s
            last_s = verdict.silence_s
    assert last_s == Patience().longest_s
    assert looked_at < 80
    assert silences > 10


def test_only_who_is_named_is_silenced() -> None:
    bot, zoe = Guard("Bot", RING), Guard("Zoe", RING)
    for number in range(20):
        bot.judge(said(), number, None, 0.0)
    assert trust(bot, said(), 1) is Trust.SILENCED
    of_zoe = said(speaker="Zoe")
    assert trust(bot, of_zoe, zoe.seal(of_zoe, 0.0)) is Trust.SEALED


def test_misheard_seals_now_and_then_silence_nobody() -> None:
    rob, bot = Guard("Rob", RING), Guard("Bot", RING)
    for number in range(300):
        seal = rob.seal(said(), 40.0 * number)
        wrong = number % 4 == 0
        assert trust(bot, said(), seal ^ wrong, 40.0 * number) is (Trust.WRONG if wrong else Trust.SEALED)


def test_who_guesses_for_two_months_is_still_heard_once_an_hour() -> None:
    silence, now = GrowingSilence(), 0.0
    while now < 60 * 86_400.0:
        now += silence.wrong("rob", now) or 0.0
        assert not silence.is_silent("rob", now)
    assert silence.wrong("rob", now) == Patience().longest_s


def test_silence_itself_forgives_nothing() -> None:
    silence = GrowingSilence(Patience(free=1.0, forgive_s=10.0, first_s=100.0))
    silence.wrong("rob", 0.0)
    assert silence.wrong("rob", 0.0) == 100.0
    assert silence.is_silent("rob", 99.0)
    assert not silence.is_silent("rob", 100.0)
    assert silence.wrong("rob", 100.0) == 200.0
    silence.right("rob", 1000.0)
    assert silence.wrong("rob", 1000.0) is None, "all is forgotten"


@pytest.mark.parametrize("bits", [6, 8])
def test_a_guess_has_the_chance_that_the_docs_compute(bits: int) -> None:
    rng = random.Random(bits)
    n, hits = 1500, 0
    for _ in range(n):  # each under a key of its own: which seals fit one sentence follows from the key
        bot = Guard("Bot", KeyRing(TeamKey(rng.randbytes(KEY_BYTES))), bits=bits, patience=CALM)
        hits += trust(bot, said(), rng.getrandbits(bits)).proves_speaker
    expected = n * (1.0 - (1.0 - 2.0**-bits) ** NEAR)
    assert abs(hits - expected) < 4.0 * expected**0.5


def doubting(saves: dict[str, int], doubt: int = 1) -> Guard:
    """Bot after a restart, with counters of which some may be missing."""
    return Guard("Bot", RING, saves | {f"doubted/{KEY.fingerprint}": doubt}, patience=CALM)


def test_whose_counters_were_lost_believes_nobody_before_it_has_answered() -> None:
    rob, bot = pair()
    recorded = [(said(text), rob.seal(said(text), 0.0)) for text in ("one", "two", "three", "four")]
    bot = doubting({}, doubt=2)
    assert [trust(bot, *each) for each in (*recorded, *recorded)] == [Trust.AHEAD] * 8
    question = AGAIN
    rob.judge(question, bot.seal(question, 10.0, challenges=True), None, 10.0, asks=True)
    answer = said("four")
    assert trust(bot, answer, rob.seal(answer, 11.0), 11.0) is Trust.FRESH
    assert trust(bot, *recorded[3], 12.0) is not Trust.SEALED
    saves = bot.saves()
    again = doubting(saves, doubt=2)
    assert trust(again, said("five"), rob.seal(said("five"), 1000.0), 1000.0) is Trust.SEALED, "the doubt is settled"
    once_more = doubting(saves, doubt=3)
    assert trust(once_more, said("six"), rob.seal(said("six"), 2000.0), 2000.0) is Trust.AHEAD, "a new one is not"


def test_codes_of_a_sheet_are_not_taken_where_nobody_knows_which_were_used() -> None:
    guard = Guard("Bot", RING, {f"lost/{KEY.fingerprint}": 1})
    code = counted_code(KEY.sheet_key, 3)
    assert guard.judge(said(), None, code, 0.0).trust is Trust.WRONG
