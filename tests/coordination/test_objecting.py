"""When robots object to another one's claim: before all confirmations, and rarely at once."""

import random

import pytest

from hil_fakes.word_plans import NAMES
from hvcpd.coordination import objecting
from hvcpd.coordination.actions import Role, Say, Speech
from hvcpd.coordination.addressing import OTHERS_SLOT, OWNER_SLOT, confirming_slot, objection_slot
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.entry import OPEN
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import plants
from tests.coordination.test_two_tasks import next_said

TRIALS = 300
ONE = m.TaskByNumber(1)


def team(size: int, seed: int = 1) -> list[Knowledge]:
    """A team in which nobody has spoken yet; the first one claims."""
    names = NAMES[:size]
    return [
        Coordination(Role(name, "plant", roster=names), plants(8), random.Random(f"{seed} {name}")).knowledge
        for name in names
    ]


@pytest.mark.parametrize("size", range(2, 13))
def test_no_robot_confirms_before_all_others_could_object(size: int) -> None:
    claimant, *others = team(size)
    for number in range(1, 9):
        slots = [objection_slot(me, claimant.role.name, number, 5.0) for me in others]
        assert min(slots) == OTHERS_SLOT > OWNER_SLOT
        assert max(slots) < min(confirming_slot(me, 5.0) for me in others) or size == 2
        assert size > 4 or len(set(slots)) == len(slots), "in a small team each has a slot of its own"


@pytest.mark.parametrize("size", [6, 9, 12])
def test_if_the_first_by_rank_is_missing_one_of_many_others_often_objects_alone(size: int) -> None:
    """They draw anew for each repetition of the claim. Of ten that draw evenly one objects alone once in a hundred
    times."""
    claimant, *others = team(size)
    alone = 0
    for _ in range(TRIALS):
        slots = [objection_slot(me, claimant.role.name, 3, 5.0) for me in others]
        slots.remove(OTHERS_SLOT)
        alone += slots.count(min(slots)) == 1
    assert alone > 0.3 * TRIALS


def claiming(name: str) -> Coordination:
    """A robot of a team of three that has claimed task one, and waits for a confirmation."""
    robot = Coordination(Role(name, "plant", roster=("Bot", "Kim", "Zoe")), plants(1), random.Random(1))
    robot.knowledge.state, robot.knowledge.current.task = State.PROPOSED, 1
    robot.board.claim(1, name, 60.0)
    return robot


def idle(name: str, owner: str | None = None) -> Coordination:
    """A robot of that team that is free; `owner` has task one."""
    robot = claiming(name)
    robot.knowledge.state, robot.knowledge.current.task = State.READY, None
    robot.board.release(1)
    if owner is not None:
        robot.board.claim(1, owner, 60.0)
    return robot


def hear(listener: Coordination, speaker: str, to: str, statement: m.Statement) -> None:
    listener.heard(m.Utterance(speaker, m.ToRobot(to), None, statement), 10.0)


@pytest.mark.parametrize("state", [State.GOING, State.ACTING])
def test_who_hears_once_that_its_task_is_done_says_that_it_is_at_it(state: State) -> None:
    kim = claiming("Kim")
    kim.knowledge.state = state
    hear(kim, "Zoe", "Bot", m.Completed(ONE))
    kim.tick(11.0)
    said = [action.utterance for action in kim.actions(11.0) if isinstance(action, Say)]
    assert said == [m.Utterance("Kim", m.ToRobot("Zoe"), None, m.Working(ONE))]
    assert (kim.task, kim.board[1].known_done) == (1, False)


def test_a_claimant_gives_way_to_a_robot_that_it_hears_confirmed() -> None:
    bot = claiming("Bot")
    hear(bot, "Zoe", "Kim", m.Confirmed(ONE))
    assert (bot.board[1].owner, bot.task) == ("Kim", None)


@pytest.mark.parametrize(("name", "other", "owner"), [("Bot", "Kim", "Bot"), ("Kim", "Bot", "Bot")])
def test_of_two_that_were_confirmed_the_first_name_keeps_the_task(name: str, other: str, owner: str) -> None:
    robot = claiming(name)
    hear(robot, "Zoe", name, m.Confirmed(ONE))
    assert robot.state is State.GOING
    hear(robot, "Zoe", other, m.Confirmed(ONE))
    assert robot.board[1].owner == owner
    assert robot.knowledge.floor.wants("mine 1") is (owner == name)
    robot.performed(20.0)
    assert robot.state is (State.ANNOUNCING if owner == name else State.READY), "it says so once more at the place"


@pytest.mark.parametrize("voice", [True, False])
def test_a_claimant_that_may_have_missed_a_bid_says_so_once_more_at_the_place(voice: bool) -> None:
    """Another robot had bid and was confirmed, and the claimant did the same task (seeds 804586 and 810060)."""
    kim = claiming("Kim")
    kim.knowledge.current.distance_m, kim.knowledge.current.claimed_s = 3, 5.0
    if voice:
        kim.channel(True, 6.0)
        kim.channel(False, 8.0)
    kim.knowledge.arm(8.0, 1.0)
    kim.tick(9.5)
    assert kim.state is State.CLAIMING
    hear(kim, "Zoe", "Kim", m.Confirmed(ONE))
    kim.performed(20.0)
    assert kim.state is (State.ANNOUNCING if voice else State.ACTING)


def confirms_kim(robot: Coordination, at_s: float) -> bool:
    """Whether it wants to confirm Kim's claim of task one, said at that time."""
    robot.heard(m.Utterance("Kim", m.ToTeam("plant"), None, m.Claim(ONE)), at_s)
    return robot.knowledge.floor.wants("confirm Kim")


@pytest.mark.parametrize("state", [State.READY, State.ASKING, State.ASKED])
@pytest.mark.parametrize("names", [("Bot", "Kim"), ("Bot", "Kim", "Zoe")])
def test_who_is_about_to_ask_what_remains_confirms_a_claim_only_when_it_is_repeated(
    state: State, names: tuple[str, ...]
) -> None:
    """Kim and the robot that confirmed it had both missed whose task it was, and those that knew missed the claim
    (seeds 872380 and 872602 of the missions over days)."""
    bot = Coordination(Role("Bot", "plant", roster=names), plants(1), random.Random(1))
    bot.knowledge.state, bot.knowledge.missed.heard_work = state, state is State.READY
    others_may_know = len(names) > 2
    assert confirms_kim(bot, 10.0) is not others_may_know
    assert confirms_kim(bot, 18.0)


@pytest.mark.parametrize("may_be_outbid", [True, False])
def test_a_claimant_that_may_have_missed_a_bid_confirms_who_it_gives_way_to_only_upon_a_repetition(
    may_be_outbid: bool,
) -> None:
    """The bidder had done the task, and the claimant confirmed a third robot, which did it again (seed 872923)."""
    zoe = claiming("Zoe")
    zoe.knowledge.current.may_be_outbid = may_be_outbid
    assert confirms_kim(zoe, 10.0) is not may_be_outbid
    assert zoe.task is None
    assert confirms_kim(zoe, 18.0)


def test_a_claimant_that_may_have_missed_a_bid_confirms_the_claims_of_other_tasks() -> None:
    """Of six that said their way with each claim, five waited for confirmations, and none confirmed anything for two
    minutes, though no sentence was lost."""
    zoe = Coordination(Role("Zoe", "plant", roster=("Bot", "Kim", "Zoe")), plants(2), random.Random(1))
    zoe.knowledge.state, zoe.knowledge.current.task = State.PROPOSED, 2
    zoe.knowledge.current.may_be_outbid = True
    assert confirms_kim(zoe, 10.0)


@pytest.mark.parametrize("denied", [True, False])
def test_who_hears_a_denial_leaves_the_task_to_whoever_has_it(denied: bool) -> None:
    """Rob had missed whose task it was, heard that Zoe was denied it, and claimed it at once; and Zoe confirmed that
    (seed 1106809 of the missions over days)."""
    bot = idle("Bot")
    bot.heard(m.Utterance("Zoe", m.ToTeam("plant"), None, m.Claim(ONE)), 9.0)
    if denied:
        hear(bot, "Max", "Zoe", m.Negative())
    assert bool(bot.board.free_for("Bot", 11.0)) is False
    assert bot.board[1].owner == (None if denied else "Zoe")
    assert confirms_kim(bot, 20.0) is False
    assert confirms_kim(bot, 28.0) is denied


def test_a_denial_does_not_undo_a_claim_that_was_confirmed() -> None:
    """Bot had missed that Ada failed, and denied her task to Zoe, who had been confirmed (seed 1119223)."""
    kim = idle("Kim")
    kim.heard(m.Utterance("Zoe", m.ToTeam("plant"), None, m.Claim(ONE)), 8.0)
    hear(kim, "Rob", "Zoe", m.Confirmed(ONE))
    hear(kim, "Bot", "Zoe", m.Negative())
    assert kim.board[1].owner == "Zoe"


def test_who_hears_a_claim_confirmed_of_a_task_that_another_robot_has_objects() -> None:
    """Bot alone knew that Rob had it, and missed Ada's claim; she did it as well (seed 1108401)."""
    bot = claiming("Bot")
    bot.knowledge.state, bot.knowledge.current.task = State.READY, None
    bot.heard(m.Utterance("Kim", m.ToTeam("plant"), None, m.Claim(ONE)), 8.0)
    bot.board.claim(1, "Kim", 60.0)
    hear(bot, "Zoe", "Kim", m.Confirmed(ONE))
    assert not bot.knowledge.floor.wants("deny 1")
    hear(bot, "Zoe", "Ada", m.Confirmed(ONE))
    assert bot.knowledge.floor.wants("deny 1")


def test_who_knows_whose_a_task_is_by_a_confirmation_objects_for_a_robot_that_it_never_heard() -> None:
    """Three robots knew so whose the task was, and it was done twice (seed 32042)."""
    bot = idle("Bot")
    hear(bot, "Zoe", "Kim", m.Confirmed(ONE))
    bot.heard(m.Utterance("Ada", m.ToTeam("plant"), None, m.Claim(ONE)), 15.0)
    assert bot.board[1].owner == "Kim"
    assert bot.knowledge.floor.wants("deny 1")


def test_a_robot_on_its_way_that_hears_another_one_at_work_says_so_once_more_at_the_place() -> None:
    """Zoe was at work already, and Max kept the task, as the first name (seed 1125271 of the missions over days)."""
    kim = claiming("Kim")
    kim.knowledge.current.claimed_s = 5.0
    hear(kim, "Bot", "Kim", m.Confirmed(ONE))
    hear(kim, "Zoe", "Kim", m.Working(ONE))
    kim.performed(20.0)
    assert (kim.board[1].owner, kim.state) == ("Kim", State.ANNOUNCING)


@pytest.mark.parametrize("denied", [True, False])
def test_a_robot_on_its_way_that_is_denied_its_task_says_so_once_more_at_the_place(denied: bool) -> None:
    kim = claiming("Kim")
    kim.knowledge.current.claimed_s = 5.0
    hear(kim, "Zoe", "Kim", m.Confirmed(ONE))
    if denied:
        hear(kim, "Bot", "Kim", m.Negative())
    kim.performed(20.0)
    assert kim.state is (State.ANNOUNCING if denied else State.ACTING)


@pytest.mark.parametrize("is_over", [True, False])
def test_who_hears_a_claim_of_its_task_and_has_done_it_when_its_turn_to_object_comes_reports_it(is_over: bool) -> None:
    """Rob fell silent, since it was no longer at work; Zoe confirmed Max, who did it again (seed 1115063)."""
    kim = claiming("Kim")
    kim.knowledge.state = State.ACTING
    kim.heard(m.Utterance("Bot", m.ToTeam("plant"), None, m.Claim(ONE)), 10.0)
    if is_over:
        kim.performed(10.1)
    kim.actions(10.1)
    kim.tick(10.7)
    (said,) = (action for action in kim.actions(10.7) if isinstance(action, Say))
    assert said.utterance.statement == (m.Completed(ONE) if is_over else m.Working(ONE))


def test_a_confirmed_report_is_no_confirmation_of_a_claim() -> None:
    """A name was misheard (seeds 702013 and 702064 of the missions over days)."""
    bot = claiming("Bot")
    hear(bot, "Zoe", "Bot", m.Confirmed(ONE, complete=True))
    assert bot.state is State.PROPOSED


def test_a_confirmed_failure_is_no_confirmation_of_a_claim() -> None:
    """Bot took the task for Kim's for minutes, and others heard that it was (seed 722022 of the missions over days)."""
    bot = idle("Bot", owner="Kim")
    bot.heard(m.Utterance("Kim", m.ToAll(), None, m.Failed(ONE)), 9.0)
    hear(bot, "Zoe", "Kim", m.Confirmed(ONE))
    assert bot.board[1].state == OPEN


def test_who_confirms_a_task_and_claims_it_itself_confirms_a_failure() -> None:
    """Bot had missed that Ada failed, and denied the task to all for minutes (seed 806390)."""
    bot = idle("Bot", owner="Kim")
    hear(bot, "Zoe", "Kim", m.ConfirmedAnd(m.Confirmed(ONE), m.Claim(ONE)))
    assert (bot.board[1].owner, bot.board[1].failed_by) == ("Zoe", {"Kim"})
    assert not bot.knowledge.floor.wants("deny 1")
    assert bot.knowledge.floor.wants("confirm Zoe")


def test_a_robot_at_work_does_not_give_way_to_one_whose_failure_was_confirmed() -> None:
    kim = claiming("Kim")
    kim.knowledge.state = State.GOING
    kim.heard(m.Utterance("Bot", m.ToAll(), None, m.Failed(ONE)), 9.0)
    hear(kim, "Zoe", "Bot", m.Confirmed(ONE))
    assert (kim.state, kim.board[1].owner) == (State.GOING, "Kim")


def test_a_failure_that_is_repeated_does_not_free_the_task_of_the_robot_that_took_over() -> None:
    """Its report was not confirmed, and others took the task as well (seed 752821 of the missions over days)."""
    bot = idle("Bot", owner="Kim")
    failed = m.Utterance("Zoe", m.ToAll(), None, m.Failed(ONE))
    bot.heard(failed, 9.0)
    assert bot.board[1].owner == "Kim"
    bot.heard(m.Utterance("Kim", m.ToAll(), None, m.Failed(ONE)), 10.0)
    assert bot.board[1].state == OPEN


def test_of_many_that_would_object_in_one_slot_the_first_voice_speaks_for_all() -> None:
    """Robots that had missed the objection that they had heard begin all repeated it at once, and collided."""
    claimant, *others = team(12)
    rivals = []
    for me in others:
        me.board.claim(1, "Kim", 300.0)
        me.state = State.READY
        me.peers.heard("Kim", 5.0, "plant")
        objecting.deny_for_third(me, claimant.role.name, me.board[1], 5.0)
        me.floor.channel(True, 5.5)
        rivals += [me.role.name] if me.floor.wants("deny 1") else []
    assert len(rivals) <= 1 + (claimant.role.name == "Kim"), "the first by rank has a slot of its own"


def test_who_repeats_an_objection_that_collided_falls_silent_when_another_robot_has_said_it() -> None:
    bot = idle("Bot", owner="Kim")
    bot.heard(m.Utterance("Kim", m.ToTeam("plant"), None, m.Claim(ONE)), 5.0)
    bot.heard(m.Utterance("Zoe", m.ToTeam("plant"), None, m.Claim(ONE)), 10.0)
    bot.tick(12.0)
    bot.spoken(14.0)
    bot.garbled(True, 14.1)
    assert bot.knowledge.floor.wants("again")
    bot.heard(m.Utterance("Max", m.ToRobot("Zoe"), None, m.Negative()), 15.0)
    assert not bot.knowledge.floor.wants("again")


@pytest.mark.parametrize("is_due", [True, False])
def test_a_robot_that_leaves_its_own_task_out_of_a_list_has_done_it(is_due: bool) -> None:
    """Rob was asked what is left before it could report, and Bot confirmed Max's claim (seeds 800866 and 801087)."""
    bot = idle("Bot", owner="Kim")
    bot.board[1].is_due = is_due  # whether Bot knows it from another robot that it was due (seed 871888)
    hear(bot, "Kim", "Bot", m.Left())
    bot.heard(m.Utterance("Zoe", m.ToAll(), None, m.Claim(ONE)), 15.0)
    assert bot.board[1].known_done
    assert bot.knowledge.floor.wants("done 1")


@pytest.mark.parametrize("sealed", [True, False])
def test_one_list_is_believed_if_its_words_are_sealed(sealed: bool) -> None:
    """Sealed words cannot be misheard; a follower that had missed a report asked four times."""
    role = Role("Bot", "plant", roster=("Bot", "Kim", "Zoe"), speech=Speech(sealed=sealed))
    bot = Coordination(role, plants(1), random.Random(1))
    bot.knowledge.missed.any_work = True
    hear(bot, "Zoe", "Bot", m.Left())
    assert bot.board[1].hearsay is not sealed
    assert bot.board[1].known_done is sealed
    bot.heard(m.Utterance("Kim", m.ToAll(), None, m.Claim(ONE)), 15.0)
    assert not bot.knowledge.floor.wants("deny 1"), "what one list left out it does not contradict"
    if sealed:
        assert next_said(bot, 15.0)[0] == m.Negative(), "it does not know which robot did it"


@pytest.mark.parametrize(
    ("said", "missed", "unable", "open_now"),
    [(None, False, False, True), (1, False, False, False), (None, True, False, False), (None, False, True, False)],
)
def test_what_nobody_has_spoken_of_is_not_done_because_others_leave_it_out(
    said: int | None, missed: bool, unable: bool, open_now: bool
) -> None:
    """They may not know it: seed 17 of a robot that alone knew task two, believed it done and denied it for ever."""
    role = Role("Bot", "plant", roster=("Bot", "Kim", "Zoe"), unable=frozenset({1} if unable else ()))
    bot = Coordination(role, plants(1), random.Random(1))
    bot.knowledge.missed.any_work = missed
    if said is not None:
        hear(bot, "Zoe", "Kim", m.Left(m.TaskByNumber(said)))
    hear(bot, "Zoe", "Bot", m.Left())
    assert (bot.board[1].state == OPEN) is open_now


def test_who_denies_what_another_one_said_in_its_name_has_not_done_it() -> None:
    bot = idle("Bot", owner="Zoe")
    bot.heard(m.Utterance("Zoe", m.ToAll(), None, m.Completed(ONE)), 5.0)
    hear(bot, "Kim", "Zoe", m.Confirmed(ONE, complete=True))
    bot.heard(m.Utterance("Kim", m.ToTeam("plant"), None, m.Claim(ONE)), 20.0)
    assert bot.knowledge.floor.wants("done 1")
    bot.heard(m.Utterance("Zoe", m.ToRobot("Bot"), None, m.Negative()), 25.0)
    assert bot.board[1].state == OPEN


def test_who_gives_way_to_a_claim_does_not_defend_it_before_it_is_confirmed() -> None:
    """Kim denied the task to all for minutes, for a robot that had been denied it itself (seed 802476)."""
    kim = claiming("Kim")
    kim.heard(m.Utterance("Bot", m.ToAll(), None, m.Claim(ONE)), 9.0)
    assert (kim.board[1].owner, kim.state) == ("Bot", State.READY)
    kim.heard(m.Utterance("Zoe", m.ToAll(), None, m.Claim(ONE)), 30.0)
    assert not kim.knowledge.floor.wants("deny 1")


@pytest.mark.parametrize(
    ("voice", "answer", "asks"),
    [(True, None, True), (True, m.WhatLeft(), False), (True, m.Negative(), True), (False, None, False)],
)
@pytest.mark.parametrize("arrived_s", [10.2, 20.0])
def test_a_robot_that_may_have_missed_an_objection_to_the_confirmation_says_so_once_more_at_the_place(
    voice: bool, answer: m.Statement | None, asks: bool, arrived_s: float
) -> None:
    """It and the robot that confirmed its claim had missed whose the task was. It stood at the place, and had begun
    before those that knew could object (seed 1123294 of the missions over days)."""
    kim = claiming("Kim")
    kim.knowledge.current.claimed_s = 5.0
    hear(kim, "Zoe", "Kim", m.Confirmed(ONE))
    if arrived_s < 12.0:
        kim.performed(arrived_s)
    kim.channel(voice, 10.6)
    kim.tick(12.0)
    assert kim.state is (State.ACTING if arrived_s < 12.0 and not voice else State.GOING)
    kim.channel(False, 12.8)
    if answer is not None:
        kim.heard(m.Utterance("Bot", m.ToRobot("Kim"), None, answer), 13.1)
    kim.tick(13.6)
    if arrived_s > 12.0:
        kim.performed(arrived_s)
    assert kim.state is (State.ANNOUNCING if asks else State.ACTING)


def test_what_a_robot_has_reported_is_known_to_others_who_leave_it_out() -> None:
    """Bot asked what is left for ever: nobody had spoken of the task as open since it was wanted again."""
    bot = Coordination(Role("Bot", "plant", roster=("Bot", "Kim", "Zoe")), plants(1), random.Random(1))
    bot.board.complete(1, "Max", hearsay=True)
    for speaker in ("Kim", "Zoe"):
        hear(bot, speaker, "Bot", m.Left())
    assert bot.board[1].known_done
