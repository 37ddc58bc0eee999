"""How much robots say, and how loudly: nothing is lost in any setting, nor where settings differ."""

from dataclasses import replace
from math import nan

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import Outage
from hil_fakes.word_plans import NAMES, random_plan, with_talk
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, Wait
from hvcpd.coordination.actions import Say, Speech, Talk
from hvcpd.coordination.chatter import ALOUD_S, CLEAR_DB, NOISY_DB
from hvcpd.coordination.coordination import Coordination
from hvcpd.language import messages as m
from tests.coordination.corridor import WEST, Corridor
from tests.coordination.mission import COLOURS, Mission

SOFTLY_DB = -10.0
QUESTION = m.WhatDoing()


def beds(n: int, work_s: float = 20.0) -> tuple[TaskDefinition, ...]:
    """Tasks in a row, which take longer than a round of turns."""
    places = [Place(float(i), 2.0) for i in range(n)]
    return tuple(
        TaskDefinition(i + 1, f"water the {COLOURS[i]} rose", place, (GoTo(place), Wait(work_s)))
        for i, place in enumerate(places)
    )


def flown(talk: Talk, names: tuple[str, ...] = ("Rob", "Bot"), **plan: object) -> Mission:
    talks = dict.fromkeys(names, talk)
    mission = Mission(names, beds(6), nearest_first=True, talks=talks, **plan)
    result = mission.run()
    assert result.agreed
    assert mission.exactly_once, mission.written()
    return mission


def own_statements(mission: Mission) -> list[m.Statement | None]:
    return [m.own_words(u.statement) for _, _, u in mission.said]


@pytest.mark.parametrize("seed", range(3))
def test_a_full_robot_says_more_and_a_terse_one_less(seed: int) -> None:
    full, normal, terse = (len(flown(talk, seed=seed).said) for talk in Talk)
    assert terse < normal < full


def test_a_full_robot_greets_tells_its_way_what_it_begins_and_that_it_is_free() -> None:
    said = flown(Talk.FULL, seed=3).written()
    assert said[0].endswith("member of team plant")
    assert any(text.endswith(("metres", "metre")) for text in said)
    assert any("completing task, water the" in text for text in said)
    assert {text for text in said if text.endswith("I am free")} == {
        f"Hi all, I am {n}, I am free" for n in ("Rob", "Bot")
    }


def test_a_normal_robot_says_none_of_these() -> None:
    said = flown(Talk.NORMAL, seed=3).written()
    assert not any("completing task, water the" in text or text.endswith("I am free") for text in said)


def test_a_terse_robot_claims_two_tasks_in_a_sentence_although_the_air_is_free() -> None:
    for talk, n in ((Talk.TERSE, 2), (Talk.NORMAL, 1)):
        first = own_statements(flown(talk, seed=3))[0]
        assert isinstance(first, m.Claim)
        assert len(first.tasks) == n


def test_a_terse_robot_with_nothing_to_do_tells_its_name_only_if_asked() -> None:
    names = ("Rob", "Bot", "Max", "Zoe", "Ada", "Kim")
    introductions = {}
    for talk in (Talk.NORMAL, Talk.TERSE):
        mission = Mission(names, beds(1), nearest_first=True, talks=dict.fromkeys(names, talk), seed=2)
        mission.run()
        mission.air.run_until(mission.air.now + 60.0)
        introductions[talk] = sum(u.statement is None for _, _, u in mission.said)
        asked_s = mission.air.now
        mission.tell(asked_s + 1.0, "Anna", m.Utterance("Anna", m.ToAll(), None, m.WhoHere()))
        mission.air.run_until(asked_s + 90.0)
        assert {speaker for at_s, speaker, _ in mission.said if at_s > asked_s + 1.0} == set(names)
    assert introductions[Talk.TERSE] == 1 < introductions[Talk.NORMAL]


@pytest.mark.parametrize("seed", range(4))
def test_teams_whose_robots_differ_lose_nothing(seed: int) -> None:
    plan = with_talk(random_plan(7100 + seed, robots=(3, 6), tasks=(5, 12), outages_max=0), "mixed")
    mission = Mission(plan.names, plan.tasks, **{k: getattr(plan, k) for k in ("seed", "conditions", "talks", "late")})
    result = mission.run()
    assert result.lost == 0
    assert result.duplicates == 0
    assert result.agreed


def note(robot: Coordination, said: list[Say]) -> None:
    """From now on, note there what the robot says, and how."""
    before = robot.knowledge.do

    def do(action: object) -> None:
        if isinstance(action, Say):
            said.append(action)
        before(action)  # type: ignore[arg-type]

    robot.knowledge.do = do  # type: ignore[method-assign,assignment]


def levels(mission: Mission) -> list[tuple[m.Utterance, float]]:
    """Each sentence with its level, from a mission that is run here."""
    said: list[Say] = []
    for robot in mission.robots.values():
        note(robot, said)
    mission.run()
    return [(say.utterance, say.level_db) for say in said]


def test_in_quiet_hours_robots_speak_softly_and_only_repeat_aloud() -> None:
    mission = Mission(("Rob", "Bot"), beds(4), nearest_first=True, softly_db=SOFTLY_DB, seed=1)
    said = levels(mission)
    assert mission.exactly_once
    assert all(level_db == SOFTLY_DB for _, level_db in said)


def test_a_sentence_without_an_answer_is_repeated_aloud() -> None:
    mission = Mission(("Rob", "Bot"), beds(1), nearest_first=True, softly_db=SOFTLY_DB, seed=1)
    mission.fail(Outage("Bot", 0.0, None))
    said = levels(mission)
    assert [level_db for _, level_db in said][:2] == [SOFTLY_DB, 0.0]


def test_who_hears_a_sentence_again_answers_it_aloud() -> None:
    mission = Mission(("Rob",), beds(2), ("Bot",), coordinator="Nobody", softly_db=SOFTLY_DB, seed=1)
    for at_s in (20.0, 30.0):
        mission.hear(at_s, "Hi Rob, I am Bot, what are you doing")
    mission.hear(200.0, "Hi Rob, I am Bot, report")
    mission.plan = replace(mission.plan, limit_s=210.0)
    answers = [level_db for u, level_db in levels(mission) if isinstance(u.statement, m.Free | m.Report)]
    assert answers == [SOFTLY_DB, 0.0, SOFTLY_DB]


def test_a_stop_is_never_soft() -> None:
    mission = Mission(("Rob", "Bot"), beds(2), nearest_first=True, softly_db=SOFTLY_DB, seed=1, limit_s=60.0)
    mission.tell(15.0, "Anna", m.Utterance(None, None, None, m.Stop()))
    of_stop = [level_db for u, level_db in levels(mission) if isinstance(u.statement, m.Stop | m.Stopped)]
    assert len(of_stop) >= 4
    assert set(of_stop) == {0.0}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("softly_db", [-10.0, -20.0])
def test_nothing_is_lost_where_soft_voices_do_not_carry(seed: int, softly_db: float) -> None:
    """At the usual level all hear each other everywhere; softly, a voice carries 4.7 m, or 1.5 m."""
    tasks = tuple(
        replace(task, place=Place(x_m, 0.0), actions=(GoTo(Place(x_m, 0.0)), Wait(5.0)))
        for task, x_m in zip(beds(6), (-6.0, 6.0, -5.0, 5.0, -4.0, 4.0), strict=True)
    )
    air = {"earshot_m": 15.0, "conditions": Conditions(0.05)}
    mission = Mission(NAMES[:3], tasks, nearest_first=True, softly_db=softly_db, seed=seed, **air)
    result = mission.run()
    assert result.lost == 0
    assert result.duplicates == 0, mission.written()
    assert result.agreed


def test_who_has_stopped_in_a_corridor_says_so_at_the_usual_level() -> None:
    bot = Corridor(("Bot", "Rob"), (), starts=(Place(0.0, 0.0), WEST), softly_db=SOFTLY_DB).robots["Bot"]
    bot.may_drive((), 1.0)
    bot.actions(1.0)
    bot.stop(2.0)
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceWanted("corridor")), 30.0)
    levels_db = []
    for at_s in (31.0, 35.0, 39.0):
        bot.tick(at_s)
        levels_db += [each.level_db for each in bot.actions(at_s) if isinstance(each, Say)]
        bot.spoken(at_s + 1.0)
    assert len(levels_db) >= 2
    assert set(levels_db) == {0.0}


class Listener:
    """Rob, whom Bot asks something in noise; `answer` tells whether the answer is said for noise."""

    def __init__(self, softly_db: float = 0.0, follows_noise: bool = True) -> None:
        speech = Speech(follows_noise=follows_noise)
        self._mission = Mission(("Rob",), beds(1), ("Bot",), coordinator="Nobody", softly_db=softly_db, speech=speech)
        self._robot = self._mission.robots["Rob"]
        self._said: list[Say] = []
        note(self._robot, self._said)
        self._mission.air.run_until(60.0)

    def wait(self, duration_s: float) -> None:
        self._mission.air.run_until(self._mission.air.now + duration_s)

    def answer(self, snr_db: float | None, question: m.Statement = QUESTION) -> bool:
        n, asked = len(self._said), m.Utterance("Bot", m.ToRobot("Rob"), None, question)
        self._robot.heard(asked, self._mission.air.now, 1.0, snr_db)
        self._mission.air.refresh()
        self.wait(12.0)
        assert len(self._said) == n + 1
        return self._said[-1].for_noise


def test_who_hears_others_in_noise_speaks_for_noise_until_all_is_clear() -> None:
    rob = Listener()
    assert not rob.answer(NOISY_DB)
    assert rob.answer(NOISY_DB - 1.0)
    assert rob.answer(CLEAR_DB), "others speak for noise, too, and so are louder"
    rob.wait(ALOUD_S)
    assert not rob.answer(CLEAR_DB)


def test_a_voice_of_unknown_level_tells_nothing_of_the_noise() -> None:
    rob = Listener()
    assert not rob.answer(None)
    assert not rob.answer(nan)
    assert rob.answer(0.0)
    assert rob.answer(nan)


def test_a_sentence_that_has_to_be_soft_is_not_said_for_noise() -> None:
    assert not Listener(softly_db=SOFTLY_DB).answer(0.0)


def test_a_sentence_whose_arrival_is_measured_is_plain() -> None:
    assert not Listener().answer(0.0, m.HowFarAway())


def test_a_robot_may_be_set_to_speak_plainly_in_noise() -> None:
    assert not Listener(follows_noise=False).answer(0.0)
