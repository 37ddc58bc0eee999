"""After the warm_up nothing needs the synthesizer any more, and it says how far it is."""

from __future__ import annotations

import gc
import itertools
import random
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from structlog.testing import capture_logs

from hvcpd.assembly.make import make_robot
from hvcpd.assembly.plan import RobotPlan
from hvcpd.assembly.sound import Sound
from hvcpd.config.settings import Settings
from hvcpd.daemon.cache_warm_up import LOGGED_EVERY_S, CacheWarmUp, Preparation, RenderJob
from hvcpd.daemon.wiring import wire_up
from hvcpd.ports import Samples
from hvcpd.recognition.stages import SynchronousWorker
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import UnitCache


class CountingCache(UnitCache):
    """Counts the units that had to be made."""

    made = 0

    def get(self, content: object, make: object) -> Samples:
        def counted() -> Samples:
            self.made += 1
            assert callable(make)
            unit = make()
            assert isinstance(unit, np.ndarray)
            return unit

        return super().get(content, counted)


def planned(directory: Path, cache: UnitCache | None, **more: object) -> tuple[RobotPlan, Sound]:
    wiring = wire_up(replace(Settings(name="Rob", names=("Rob", "Bot", "Zoe"), state_dir=directory), **more))  # type: ignore[arg-type]
    return wiring.plan(channel=SynchronousWorker(), second=SynchronousWorker()), replace(wiring.sound, cache=cache)


@pytest.mark.slow
def test_each_stage_has_all_that_is_needed_from_then_on(tmp_path: Path, units: Path) -> None:
    cache = CountingCache(units)
    plan, sound = planned(tmp_path, cache)
    warm_up = CacheWarmUp(plan, sound)
    warm_up.before_listening()
    cache.made = 0
    robot = make_robot(plan, sound)
    assert cache.made <= 8, "only what tells the call from a name that sounds like it"
    warm_up.before_speaking()
    cache.made = 0
    rng = random.Random(1)
    speaker = sound.speaker_of("Rob")
    for _ in range(200):
        assert len(speaker.render(robot.phrasebook.phrases(robot.phrasebook.sample(rng)))) > 0
    assert cache.made == 0
    warm_up.the_rest(robot)
    cache.made = 0
    robot = make_robot(plan, sound)
    robot.prepare(lambda: True)
    slowly = sound.speaker_of("Rob", 1.0 / 1.25)
    for stage in (warm_up.before_listening, warm_up.before_speaking):
        stage()
    warm_up.the_rest(robot)
    assert cache.made == 0
    assert slowly.voice.rate < speaker.voice.rate


def test_without_a_cache_there_is_nothing_to_do(tmp_path: Path) -> None:
    plan, sound = planned(tmp_path, None)
    made = Preparation(lambda _: pytest.fail("something was made"))
    warm_up = CacheWarmUp(plan, sound, made)
    warm_up.before_listening()
    warm_up.before_speaking()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("is_blocked", [True, False])
def test_words_that_cannot_be_kept_are_told_with_the_reason(tmp_path: Path, is_blocked: bool) -> None:
    """A file stands where the folder should be, which even root cannot write into."""
    folder = tmp_path / "units"
    if is_blocked:
        folder.write_text("in the way")
    warm_up = CacheWarmUp(*planned(tmp_path, UnitCache(folder)))
    warm_up.learn("Zelda")
    with capture_logs() as logs:
        warm_up.tell_unkept()
    assert [line["reason"].startswith(f"{folder}: cannot be written: ") for line in logs] == [True] * is_blocked


def test_whoever_ends_meanwhile_waits_for_one_word_at_most(tmp_path: Path) -> None:
    cache = CountingCache(tmp_path / "units")
    plan, sound = planned(tmp_path, cache)
    made = Preparation(lambda _: made.stop())
    CacheWarmUp(plan, sound, made).before_listening()
    assert 0 < cache.made <= 4


class Work:
    """Words that take a while, by a clock of their own."""

    def __init__(self, word_s: float) -> None:
        self.now_s, self._word_s = 100.0, word_s
        self.texts: list[str] = []
        self.preparation = Preparation(self.texts.append, lambda: self.now_s)

    def make(self, _word: str) -> None:
        self.now_s += self._word_s

    def jobs(self, *lengths: int) -> Iterable[RenderJob]:
        return [RenderJob(f"part {n}", tuple(map(str, range(length))), self.make) for n, length in enumerate(lengths)]


def test_it_says_how_far_it_is_every_few_seconds() -> None:
    work = Work(0.25)
    with capture_logs() as logs:
        work.preparation.run(work.jobs(30, 30))
    assert work.texts == [f"preparing words: part {done // 30}, {done} of 60" for done in range(0, 60, 4)], (
        "once a second"
    )
    assert [(line["what"], line["done"], line["of"]) for line in logs] == [("part 0", 20, 60), ("part 1", 40, 60)]
    assert work.preparation.text is None


def test_a_start_with_all_words_there_logs_nothing() -> None:
    work = Work(0.0001)
    with capture_logs() as logs:
        work.preparation.run(work.jobs(1000, 1000))
    assert logs == []


def test_what_others_make_is_counted() -> None:
    work = Work(0.0)
    step = work.preparation.counted("sentences", 40)
    with capture_logs() as logs:
        while step():
            work.now_s += 1.0
            if work.now_s >= 140.0:
                work.preparation.stop()
    work.preparation.ended()
    assert work.texts[-1] == "preparing words: sentences, 40 of 40"
    assert len(logs) == 40 // LOGGED_EVERY_S
    assert work.preparation.text is None


@pytest.mark.slow
def test_speakers_of_spelled_letters_end_with_them(tmp_path: Path, units: Path) -> None:
    plan, sound = planned(tmp_path, UnitCache(units))
    alive: list[int] = []

    def count(text: str) -> None:
        if "others' sentences" in text and not alive:
            alive.append(speakers())
            made.stop()

    made = Preparation(count, itertools.count().__next__)
    warm_up = CacheWarmUp(plan, sound, made)
    robot = make_robot(plan, sound)
    before = speakers()
    warm_up.the_rest(robot)
    assert alive == [before]


def speakers() -> int:
    """Speakers that are in use."""
    gc.collect()
    return sum(isinstance(each, Speaker) for each in gc.get_objects())
