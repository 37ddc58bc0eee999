"""What a robot with a key believes, and what it says where it does not."""

from __future__ import annotations

import random
from collections import Counter

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_seals import WordSeals, keyed_book
from hvcpd.coordination.actions import Role
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import AT_WORK, State
from hvcpd.language import messages as m
from hvcpd.security.guard import Guard
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.security.one_time import counted_code
from hvcpd.security.trust import People, Trust
from tests.coordination.mission import Mission, next_sentence, plants

KEY = TeamKey(bytes(KEY_BYTES))
NAMES = ("Rob", "Bot")
TASKS = plants(2)
STEP_S = 25.0
"""Between two sentences of a person: the robots' answers are out."""


def keyed(
    people: People = People.QUESTIONS, names: tuple[str, ...] = NAMES, encrypts: bool = False, **plan: object
) -> Mission:
    """A team with a key, and Ann, who has none."""
    book = keyed_book((*names, "Ann"), TASKS)
    mission = Mission(
        names, TASKS, ("Ann",), seals=WordSeals(book, KeyRing(KEY), encrypts=encrypts), limit_s=600.0, **plan
    )
    mission.book = book
    for robot in mission.robots.values():
        object.__setattr__(robot.role, "people", people)
    return mission


def standing(mission: Mission) -> None:
    """The robots have greeted, and take on nothing by themselves."""
    for robot in mission.robots.values():
        object.__setattr__(robot.role, "volunteer", False)
    mission.air.run_until(30.0)


def after(mission: Mission, text: str, speaker: str = "Ann") -> list[str]:
    """What the robots say within STEP_S of a sentence that somebody else says."""
    now = mission.air.now
    mission.hear(now, text, speaker)
    mission.air.run_until(now + STEP_S)
    return mission.written(now, without=(speaker,))


@pytest.mark.parametrize("coordinator", [None, "Bot"])
@pytest.mark.parametrize("loss", [0.0, 0.1])
@pytest.mark.parametrize("encrypts", [False, True])
def test_a_team_with_a_key_does_every_task_once(coordinator: str | None, loss: float, encrypts: bool) -> None:
    mission = keyed(coordinator=coordinator, conditions=Conditions(loss=loss), seed=3, encrypts=encrypts)
    mission.run()
    assert mission.exactly_once
    plain = [u for _, _, u in mission.said if u.statement is not None and not isinstance(u.mark, m.Cipher)]
    assert bool(plain) != encrypts
    verdicts = mission.plan.seals.verdicts if mission.plan.seals else {}
    assert verdicts[Trust.FRESH] + verdicts[Trust.SEALED] >= 6
    assert not any(isinstance(u.statement, m.Distrusted) for _, _, u in mission.said)


def test_an_order_without_a_seal_is_not_obeyed_and_said_so() -> None:
    mission = keyed()
    standing(mission)
    assert after(mission, "Hi Rob, I am Ann, move forward one metre") == ["Hi Ann, I am Rob, I do not trust that"]
    assert mission.robots["Rob"].state is State.READY
    assert after(mission, "Rob, turn left")[:1] == ["Hi all, I am Rob, I do not trust that"]
    assert after(mission, "Hi Bot, I am Ann, water the green rose") == ["Hi Ann, I am Bot, I do not trust that"]


def test_stop_greetings_and_questions_need_none() -> None:
    mission = keyed()
    standing(mission)
    assert after(mission, "Hi Rob, I am Ann, what are you doing") == ["Hi Ann, I am Rob, I am free"]
    assert len(after(mission, "Hi all, I am Ann")) == 2
    after(mission, "stop")
    assert {robot.state for robot in mission.robots.values()} == {State.STOPPED}
    said = after(mission, "resume")
    assert [text.partition("I do not")[2] for text in said] == [" trust that"]
    assert {robot.state for robot in mission.robots.values()} == {State.STOPPED}


def test_a_code_of_the_sheet_is_as_good_as_a_key_once() -> None:
    mission = keyed()
    standing(mission)
    digits = [mission.book.write(_coded(counted_code(KEY.sheet_key, count))) for count in range(2)]
    assert "I will turn left" in after(mission, digits[0])[0]
    assert "say again" in after(mission, digits[0])[0]
    assert "I will turn left" in after(mission, digits[1])[0]


def test_who_gave_a_code_may_confirm_what_was_read_back_and_nobody_else_may() -> None:
    mission = keyed()
    standing(mission)
    order = m.Utterance("Ann", m.ToRobot("Rob"), None, m.Order(m.TaskByNumber(1)))
    text = f"{mission.book.write(order)}, code " + " ".join(counted_code(KEY.sheet_key, 0))
    now = mission.air.now
    mission.hear(now, text, "Ann")
    mission.air.run_until(now + 12.0)
    assert mission.robots["Rob"].state is State.READ_BACK
    mission.hear(now + 12.0, "Hi Rob, I am Bot, confirmed", "Mallory")
    mission.air.run_until(now + 16.0)
    assert mission.robots["Rob"].state is State.READ_BACK
    mission.hear(now + 27.0, "Hi Rob, I am Ann, confirmed", "Ann")
    mission.air.run_until(now + 40.0)
    assert mission.robots["Rob"].state in AT_WORK
    assert mission.robots["Rob"].task == 1


def test_who_gave_a_code_may_take_a_motion_back_while_it_is_made() -> None:
    """One that was heard surely is made as soon as it is read back, and its code is valid once."""
    mission = keyed()
    standing(mission)
    mission.holds_motion = True
    rob, now = mission.robots["Rob"], mission.air.now
    mission.hear(now, mission.book.write(_coded(counted_code(KEY.sheet_key, 0))), "Ann")
    for name, state in (("Bot", State.MOVING), ("Ann", State.READY)):
        mission.air.run_until(mission.air.now + 12.0)
        assert rob.state is State.MOVING
        mission.hear(mission.air.now, f"Hi Rob, I am {name}, negative", name)
        mission.air.run_until(mission.air.now + 3.0)
        assert rob.state is state


def test_who_gave_a_code_may_confirm_while_the_robot_is_about_to_repeat_itself() -> None:
    mission = keyed()
    standing(mission)
    order = m.Utterance("Ann", m.ToRobot("Rob"), None, m.Order(m.TaskByNumber(1)))
    text = f"{mission.book.write(order)}, code " + " ".join(counted_code(KEY.sheet_key, 0))
    mission.hear(mission.air.now, text, "Ann")
    rob = mission.robots["Rob"]
    mission.run_until(lambda: rob.state is State.READING_BACK and rob.knowledge.current.repeats, limit_s=100.0)
    rob.heard(m.Utterance("Ann", m.ToRobot("Rob"), None, m.Confirmed()), mission.air.now, trust=Trust.BARE)
    assert rob.state in AT_WORK


def _coded(digits: str) -> m.Utterance:
    return m.Utterance("Ann", m.ToRobot("Rob"), None, m.TurnBy(90.0), m.Code(digits))


def test_who_has_the_key_is_asked_however_often_its_answer_is_lost() -> None:
    mission = keyed()
    standing(mission)
    bot, began_s = mission.robots["Bot"], mission.air.now
    order = m.Utterance("Rob", m.ToRobot("Bot"), None, m.Order(m.TaskByNumber(1)))
    for number in range(4):
        bot.heard(order, began_s + STEP_S * number, trust=Trust.SEALED)
        mission.air.refresh(("Bot",))
        mission.air.run_until(began_s + STEP_S * (number + 1))
    said = [u.statement for at_s, who, u in mission.said if who == "Bot" and at_s > began_s]
    assert [s for s in said if isinstance(s, m.SayAgain | m.Distrusted)] == [m.SayAgain()] * 4


def test_people_order_robots_that_encrypt_and_are_answered_plainly() -> None:
    mission = keyed(encrypts=True)
    standing(mission)
    [read_back] = after(mission, mission.book.write(_coded(counted_code(KEY.sheet_key, 0))))[:1]
    assert read_back.startswith("Hi Ann, I am Rob, I will turn left")


def test_a_message_that_was_misheard_is_asked_for_again_and_one_of_another_team_is_not_believed() -> None:
    mission = keyed(encrypts=True)
    standing(mission)
    wrong = m.Utterance("Bot", m.ToRobot("Rob"), None, m.SealedMessage(), m.Cipher(12345, mission.book.cipher_words))
    now = mission.air.now
    for number in range(3):
        mission.tell(now + STEP_S * number, "Mallory", wrong)
    mission.air.run_until(now + 3.0 * STEP_S)
    said = [u.statement for at_s, who, u in mission.said if who == "Rob" and at_s > now]
    assert [type(statement) for statement in said] == [m.SayAgain, m.SayAgain, m.Distrusted]


@pytest.mark.parametrize("is_sealed", [False, True])
def test_a_robot_without_a_key_keeps_out_of_a_sealed_message(is_sealed: bool) -> None:
    """Asked to confirm, it would else ask for the code words again."""
    mission = Mission(NAMES, TASKS, ("Ann",))
    standing(mission)
    rob, now = mission.robots["Rob"], mission.air.now
    mission.hear(now, "Hi Rob, I am Ann, water the green rose", "Ann")
    mission.air.run_until(now + 11.0)
    assert rob.state is State.READ_BACK
    if is_sealed:
        mission.hear(now + 11.0, "Hi all, I am Ann, sealed message", "Ann")
        mission.air.run_until(now + 15.0)
    rob.garbled(False, mission.air.now)
    mission.air.refresh()
    garbled_s = mission.air.now
    mission.air.run_until(garbled_s + 4.0)
    assert ("say again" in " ".join(mission.written(garbled_s))) != is_sealed


@pytest.mark.parametrize(
    ("people", "answers"),
    [(People.EVERYTHING, ["turn", "free"]), (People.QUESTIONS, ["trust", "free"]), (People.NOTHING, ["trust", ""])],
)
def test_what_people_may_is_set(people: People, answers: list[str]) -> None:
    mission = keyed(people)
    standing(mission)
    texts = ("Hi Rob, I am Ann, turn left", "Hi Rob, I am Ann, what are you doing")
    for text, answer in zip(texts, answers, strict=True):
        said = " ".join(after(mission, text))
        assert answer in said
        assert bool(said) == bool(answer)


def test_nobody_may_speak_for_a_robot_even_where_people_may_do_everything() -> None:
    mission = keyed(People.EVERYTHING)
    standing(mission)
    said = after(mission, "Hi Rob, I am Bot, turn left", "Mallory")
    assert "I will turn left" not in " ".join(said)
    assert any("say again" in text or "trust" in text for text in said)


def test_a_wrong_seal_is_asked_for_again_and_then_refused() -> None:
    mission = keyed()
    standing(mission)
    said = [after(mission, f"Hi Rob, I am Bot, turn left, {seal}", "Mallory") for seal in ("tango " * 4, "kilo " * 4)]
    assert "say again" in said[0][0]
    mission.robots["Bot"].knowledge.repair.last_said = None  # it is silent, and Mallory goes on
    texts = [
        text for _ in range(3) for text in after(mission, f"Hi Rob, I am Bot, turn left, {'lima ' * 4}", "Mallory")
    ]
    assert any("I do not trust that" in text for text in texts)
    assert "I will turn left" not in " ".join(said[0] + said[1] + texts)


def test_a_recording_is_refused_at_once_and_later_and_does_not_make_robots_talk_for_hours() -> None:
    mission = keyed(coordinator="Bot")
    mission.air.run_until(60.0)
    order = next(u for _, who, u in reversed(mission.said) if who == "Bot" and isinstance(u.statement, m.Order))
    listener = order.addressee.name if isinstance(order.addressee, m.ToRobot) else ""
    mission.run()
    for _ in range(40):
        mission.speak("Mallory", order)
        mission.air.run_until(mission.air.now + STEP_S)
    told = [text for text in mission.written(without=("Mallory",)) if "I do not trust that" in text]
    assert 1 <= len(told) <= 8
    assert mission.exactly_once
    assert mission.robots[listener].state is State.READY


def test_an_order_that_was_missed_and_is_played_later_has_to_be_proved() -> None:
    mission = keyed()
    standing(mission)
    order = m.Utterance("Bot", m.ToRobot("Rob"), None, m.TurnBy(90.0))
    bot = Guard("Bot", KeyRing(KEY))
    seals = WordSeals(mission.book, KeyRing(KEY))
    seals.switch_on("Bot")
    recorded = seals.marked("Bot", order, 0.0)
    assert bot is not None
    said = after(mission, mission.book.write(recorded), "Mallory")
    assert "say again" in said[0]
    assert "I will turn left" not in " ".join(said)


def test_the_own_name_without_a_seal_is_no_name_conflict() -> None:
    mission = keyed()
    standing(mission)
    for _ in range(3):
        after(mission, "Hi Bot, I am Rob, task one complete", "Mallory")
    assert mission.robots["Rob"].knowledge.acquaintance.own_name_heard_s == ()


def test_an_unbelieved_claim_takes_no_task() -> None:
    mission = keyed()
    standing(mission)
    after(mission, "Hi all, I am Bot, I will complete task two", "Mallory")
    after(mission, "Hi all, I am Ann, task one complete")
    assert [entry.state for entry in mission.robots["Rob"].board.entries()] == ["open", "open"]


def believed_late(pause_s: float) -> Coordination:
    """Rob, which has believed Bot's order only when it heard it again after this pause: of the first the seal was
    misheard."""
    rob = Coordination(Role("Rob", "plant", roster=NAMES), TASKS, random.Random(1))
    rob.heard(m.Utterance("Bot", m.ToTeam("plant")), 0.5)
    rob.knowledge.state = State.READY
    order = m.Utterance("Bot", m.ToRobot("Rob"), None, m.Order(m.TaskByNumber(2)), m.Seal(1))
    now = 10.0
    for trust, after_s in ((Trust.WRONG, 0.0), (Trust.FRESH, pause_s)):
        rob.channel(True, now + after_s)
        now += after_s + 3.0
        rob.channel(False, now)
        rob.heard(order, now, trust=trust)
    return rob


def test_of_an_order_that_is_said_twice_the_second_counts_if_the_seal_of_the_first_was_misheard() -> None:
    """It was left out as a repetition, and the robot asked for the order to be said again."""
    assert believed_late(0.5).state is State.READING_BACK


def test_who_is_believed_meanwhile_is_not_asked_to_say_it_again() -> None:
    rob, said = believed_late(5.0), []
    while rob.state is State.READING_BACK:
        said.append(next_sentence(rob)[0].statement)
    assert said == [m.Claim(m.TaskByNumber(2))]


@pytest.mark.parametrize("seed", [2, 3])
def test_nobody_repeats_a_claim_for_the_voice_of_who_is_revoked(seed: int) -> None:
    """Each of its sentences, which confirmed the claim, had it repeated once more."""
    seals = WordSeals(keyed_book(NAMES, TASKS), KeyRing(KEY, revoked=frozenset({"bot"})))
    mission = Mission(NAMES, TASKS, seed=seed, seals=seals)
    assert mission.run().agreed
    claims = Counter(u.statement for _, who, u in mission.said if who == "Rob" and isinstance(u.statement, m.Claim))
    assert max(claims.values()) <= 8
