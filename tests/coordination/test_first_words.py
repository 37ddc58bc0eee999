"""Who may confirm when, among robots that know each other's names beforehand and have not all said a word yet."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.coordination.actions import Role
from hvcpd.coordination.addressing import confirming_slot, note_introduced, note_presence
from hvcpd.coordination.coordination import Coordination
from hvcpd.language import messages as m
from hvcpd.security.trust import Trust
from tests.coordination.mission import plants

NAMES = ("Rob", "Bot", "Max", "Zoe", "Ada", "Kim")
THREE = m.TaskByNumber(3)
SENTENCE_S = 5.0
CONFIRMATIONS = (m.Confirmed(THREE), m.ConfirmedAnd(m.Confirmed(THREE), m.Claim(m.TaskByNumber(4))))
SAID = st.tuples(st.integers(0, 5), st.sampled_from((None, m.Claim(THREE), *CONFIRMATIONS)))


def robot(name: str, stopped: bool = False) -> Coordination:
    return Coordination(Role(name, "plant", roster=NAMES), plants(8), random.Random(1), stopped=stopped)


def say(robots: dict[str, Coordination], u: m.Utterance, now: float) -> None:
    """One robot says a sentence, and all others understand it."""
    for name, each in robots.items():
        if name != u.speaker:
            each.heard(u, now)
            continue
        if each.knowledge.acquaintance.introduced:
            note_presence(each.knowledge, u, now)
        note_introduced(each.knowledge)


@given(st.integers(2, 6), st.booleans(), st.lists(SAID, max_size=8), st.integers(0, 5))
def test_no_two_confirm_in_one_slot_where_all_is_heard(
    there: int, stopped: bool, said: list[tuple[int, m.Statement | None]], claims: int
) -> None:
    """However many of those who were told of are there, and whoever has spoken or was silent until then."""
    on = NAMES[:there]
    robots = {name: robot(name, stopped) for name in on}
    for n, (who, statement) in enumerate([*said, (claims, m.Claim(THREE))]):
        speaker, other = on[who % there], on[(who + 1) % there]
        to = m.ToRobot(other) if isinstance(statement, m.Confirmed | m.ConfirmedAnd) else m.ToTeam("plant")
        say(robots, m.Utterance(speaker, to, None, statement), SENTENCE_S * (n + 1))
    now, asker = SENTENCE_S * (len(said) + 1), on[claims % there]
    listeners = [each.knowledge for name, each in robots.items() if name != asker]
    slots = [confirming_slot(me, now) + me.rank_with_unheard(asker, 3, now) for me in listeners]
    assert len(set(slots)) == len(slots)


@pytest.mark.parametrize(
    ("speaker", "statement", "trust"),
    [
        ("Anna", m.Confirmed(THREE), Trust.OPEN),  # a person, who knows no slots
        ("Bot", m.Confirmed(), Trust.OPEN),  # to whom it has given an order: nobody else may answer there
        ("Bot", m.Confirmed(THREE), Trust.WRONG),  # somebody without the key
    ],
)
def test_what_is_confirmed_out_of_turn_tells_nothing_of_the_silent(
    speaker: str, statement: m.Statement, trust: Trust
) -> None:
    rob = robot("Rob")
    note_introduced(rob.knowledge)
    rob.heard(m.Utterance("Bot", m.ToAll(), None, None), 5.0)
    rob.heard(m.Utterance(speaker, m.ToRobot("Max"), None, statement), 10.0, trust=trust)
    assert rob.knowledge.acquaintance.unheard == {"max", "zoe", "ada", "kim"}
