"""Whole robots in the simulated room: real sound, real motors' bytes, virtual time."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from hil_fakes.bench import Bench, BenchPlan
from hil_fakes.bench_plans import relay_plan
from hil_fakes.room import Air
from hvcpd.assembly.make import make_template_recogniser
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, TaskRepository, Tend
from hvcpd.coordination.actions import Speech
from hvcpd.ports import Samples
from hvcpd.recognition.events import Recognised
from hvcpd.reporting.events import Heard, MissionRecord, Performed, Said, Summary, TaskChanged
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey

pytestmark = pytest.mark.slow
NAMES = ("Rob", "Bot")


def plant(number: int, colour: str, x_m: float, y_m: float) -> TaskDefinition:
    place = Place(x_m, y_m)
    return TaskDefinition(number, f"water the {colour} rose", place, (GoTo(place), Tend(2.0)))


TWO = TaskRepository((plant(1, "green", -4.0, -3.5), plant(2, "orange", -2.5, -4.5)))
ONE = TaskRepository(TWO.tasks[:1])
"""As many as what a test is about needs: each takes its time. `tests/release/test_readme.py` has five shared out."""


@cache
def sound() -> Sound:
    return make_sound(None, user_cache_folder())


def ordered(seed: int, limit_s: float) -> Bench:
    """Two plants, which the coordinator orders one after the other."""
    return Bench(BenchPlan(NAMES, TWO, seed, coordinator="Bot", limit_s=limit_s), sound())


@cache
def flown() -> tuple[MissionRecord, Bench]:
    """The whole of it."""
    bench = ordered(3, 200.0)
    return bench.run(), bench


def summary(record: MissionRecord) -> Summary:
    [found] = [event for event in record.events if isinstance(event, Summary)]
    return found


def test_every_plant_is_watered_exactly_once() -> None:
    score = summary(flown()[0])
    assert (len(score.done), score.duplicates, score.lost) == (2, 0, 0)
    assert score.utterances_understood > 6


def test_robots_that_were_told_only_their_own_names_spell_them_and_do_a_task_once() -> None:
    plan = BenchPlan(NAMES, ONE, 3, strangers=True, limit_s=200.0)
    bench = Bench(plan, sound())
    record = bench.run()
    score = summary(record)
    said = [e.text for e in record.events if isinstance(e, Said)]
    assert any(text.endswith("I spell, bravo oscar tango") for text in said)
    assert any(text.endswith("I spell, romeo oscar bravo") for text in said)
    assert any(text.startswith(("Hi Bot, I am Rob, confirmed", "Hi Rob, I am Bot, confirmed")) for text in said)
    assert (len(score.done), score.duplicates, score.lost) == (1, 0, 0)
    assert [set(robot.phrasebook.vocabulary.names) for robot in bench.robots.values()] == [{"Rob", "Bot"}] * 2


def test_said_slowly_and_twice_everything_is_done_once_and_the_floor_is_kept_between() -> None:
    record = Bench(BenchPlan(NAMES, ONE, 3, speech=Speech(slowly=True, times=2), limit_s=400.0), sound()).run()
    score = summary(record)
    assert (len(score.done), score.duplicates, score.lost) == (1, 0, 0)
    said = [e for e in record.events if isinstance(e, Said)]
    heard = [e for e in record.events if isinstance(e, Heard)]
    for before, after in pairwise(said):  # two may begin at the same moment, before either can be heard
        assert after.at_s >= before.end_s or after.at_s - before.at_s < 0.3
    assert len(heard) > 1.8 * score.utterances_understood, "each sentence was heard twice"


def test_an_order_and_its_report_cross_the_robot_between_two_that_do_not_hear_each_other() -> None:
    plan = relay_plan(1)
    record = Bench(plan, sound()).run()
    score = summary(record)
    assert (score.done, score.duplicates, score.lost) == ({"water the green rose": "Zoe"}, 0, 0)
    said = {e.utterance: e for e in record.events if isinstance(e, Said)}
    crossed = [
        (e.listener, said[e.utterance].speaker)
        for e in record.events
        if isinstance(e, Heard) and e.utterance is not None and e.at_s > plan.earshot_from_s
    ]
    assert {("Zoe", "Max"), ("Rob", "Max")} <= set(crossed)
    assert not {("Zoe", "Rob"), ("Rob", "Zoe")} & set(crossed)
    relays = [e.text for e in said.values() if " says, " in e.text]
    for text in (
        "Hi Zoe, I am Max, Rob says, water the green rose",
        "Hi Rob, I am Max, Zoe says, I will water the green rose",
        "Hi Rob, I am Max, Zoe says, task one complete",
    ):
        assert text in relays


def test_robots_that_encrypt_do_every_task_once_and_say_no_word_of_it() -> None:
    """One task: sentences of eight code words take their time."""
    keys = KeyRing(TeamKey(bytes(KEY_BYTES)))
    bench = Bench(BenchPlan(NAMES, ONE, 3, keys=keys, encrypts=True, limit_s=200.0), sound())
    record = bench.run()
    score = summary(record)
    assert (len(score.done), score.duplicates, score.lost) == (1, 0, 0)
    said = [e for e in record.events if isinstance(e, Said)]
    heard = [e for e in record.events if isinstance(e, Heard)]
    assert all(e.seal == "encrypted" for e in said if "task" in e.text or "confirmed" in e.text)
    assert sum(e.seal == "encrypted" and "task" in e.text for e in heard) >= 2
    words = {word for e in heard if e.seal for word, _, _ in e.words}
    assert {"sealed", "message"} < words
    assert not {"task", "complete", "confirmed"} & words


def test_a_robot_alone_is_understood_by_nobody() -> None:
    record = Bench(BenchPlan(("Rob",), TWO, 3, limit_s=20.0), sound()).run()
    assert summary(record).utterances_sent > 0
    assert summary(record).utterances_understood == 0


def test_who_is_ordered_reads_back_and_reports() -> None:
    said = [(e.speaker, e.text) for e in flown()[0].events if isinstance(e, Said)]
    order = next(i for i, (who, text) in enumerate(said) if who == "Bot" and text.startswith("Hi Rob, I am Bot, water"))
    task = said[order][1].removeprefix("Hi Rob, I am Bot, ")
    assert ("Rob", f"Hi Bot, I am Rob, I will {task}") in said[order:]
    assert any(who == "Rob" and text.endswith("complete") for who, text in said[order:])


def test_a_mission_whose_robots_all_stand_stopped_ends_once_they_have_said_so() -> None:
    def stop_both(now: float, _sound: Samples) -> None:
        if now == 10.0:
            for robot in bench.robots.values():
                robot.coordination.stop(robot.now)

    bench = Bench(BenchPlan(NAMES, ONE, 3, limit_s=200.0), sound(), pace=stop_both)
    record = bench.run()
    said = [event for event in record.events if isinstance(event, Said)]
    hints = [event for event in said if event.text.endswith("I have stopped until you say resume")]
    assert {event.speaker for event in hints} == set(NAMES)
    assert said[-1].end_s < summary(record).virtual_s < said[-1].end_s + 10.0
    assert summary(record).lost == 1
    assert summary(record).stopped == NAMES


def test_with_the_air_muted_nothing_is_coordinated() -> None:
    bench = Bench(BenchPlan(NAMES, ONE, 3, air=Air(muted=True), limit_s=200.0), sound())
    record = bench.run()
    assert not [event for event in record.events if isinstance(event, Heard)]
    for name, robot in bench.robots.items():
        assert robot.coordination.peers.all() == ()
        owners = {robot.coordination.board[task.number].owner for task in ONE.tasks}
        assert owners <= {name, None}
    assert summary(record).duplicates == 1  # each robot believes itself alone, and waters


def test_a_seed_tells_the_whole_mission() -> None:
    """Until both have talked, and one has driven and worked."""
    seen_s = 44.0
    again, first = ordered(3, seen_s).run(), flown()[0]
    assert np.array_equal(again.sound, first.sound[: len(again.sound)])
    events = [e for e in again.events if not isinstance(e, Summary | Said)]  # at the end somebody may be talking
    assert {Heard, TaskChanged, Performed} <= {type(e) for e in events}
    assert events == [e for e in first.events if not isinstance(e, Summary | Said)][: len(events)]
    assert [e.text for e in again.events if isinstance(e, Said)] == [
        e.text for e in first.events if isinstance(e, Said) and e.at_s < seen_s
    ]


def test_another_seed_is_another_mission() -> None:
    assert not np.array_equal(ordered(4, 8.0).run().sound[:112_000], flown()[0].sound[:112_000])


def reheard(recording: Samples) -> Iterator[str]:
    """The sentences in a recording, heard without knowing when the robot itself spoke."""
    book = make_phrasebook(NAMES, DEFAULT_TEAMS, TWO)
    recogniser = make_template_recogniser(book, NAMES, sound())
    for event in recogniser.push(recording) + recogniser.flush():
        if isinstance(event, Recognised):
            yield book.write(book.parse(event.words))


def test_a_robots_recording_gives_the_missions_transcript() -> None:
    record, bench = flown()
    own = [(e.at_s, e.text) for e in record.events if isinstance(e, Said) and e.speaker == "Bot"]
    others = [(e.at_s, e.text) for e in record.events if isinstance(e, Heard) and e.listener == "Bot"]
    assert list(reheard(bench.recordings["Bot"])) == [text for _at_s, text in sorted(own + others)]
