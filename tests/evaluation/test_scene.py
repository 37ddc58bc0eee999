"""The simulated bench: its levels are those that it states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hil_fakes.reverberation import decay_s, response
from hvcpd.evaluation import calls, listeners
from hvcpd.evaluation.scene import Bench, heard_at, noise, stream
from hvcpd.evaluation.statistics import Step
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.leveling import audible

SILENT = replace(Bench(), ambient_db_spl=-60.0, self_noise_db_spl=-60.0, robot_noise_db_spl=None)


def level_db_spl(sound: Samples, bench: Bench) -> float:
    return float(10.0 * np.log10(np.mean(np.square(sound, dtype=np.float64)))) + bench.full_scale_db_spl


def tone() -> Samples:
    return (0.1 * np.sin(2 * np.pi * 1000.0 / SAMPLE_RATE_HZ * np.arange(SAMPLE_RATE_HZ))).astype(np.float32)


@pytest.mark.parametrize(
    ("field", "level"), [("ambient_db_spl", 50.0), ("self_noise_db_spl", 45.0), ("robot_noise_db_spl", 55.0)]
)
def test_each_noise_has_the_level_that_is_stated(field: str, level: float) -> None:
    bench = replace(SILENT, **{field: level})
    found = noise(20 * SAMPLE_RATE_HZ, bench, np.random.default_rng(1))
    assert level_db_spl(found, bench) == pytest.approx(level, abs=0.5)


def test_speech_leaves_the_loudspeaker_at_the_level_that_is_stated() -> None:
    for gain in (1.0, 0.01):
        sound, said = stream([(("a",), gain * tone())] * 2, SILENT, np.random.default_rng(1))
        first, _ = audible(tone())
        for s in said:
            assert level_db_spl(sound[s.start + first : s.end], SILENT) == pytest.approx(65.0, abs=0.1)


def test_sound_arrives_when_and_as_loud_as_the_distance_says() -> None:
    pytest.importorskip("pyroomacoustics", reason="needs pyroomacoustics, of the eval extra")
    hiss = (0.1 * np.random.default_rng(3).standard_normal(SAMPLE_RATE_HZ)).astype(np.float32)
    sound, (said,) = stream([(("a",), hiss)], SILENT, np.random.default_rng(1))
    levels = []
    for distance_m in (0.5, 1.0, 4.0):
        impulse, delay = response(SILENT.hall, distance_m)
        assert abs(int(np.argmax(np.abs(impulse))) - delay) <= 3  # the floor's echo comes within two samples at 4 m
        heard = heard_at(sound, distance_m, SILENT, np.random.default_rng(2))
        assert len(heard) == len(sound)
        assert np.abs(heard[: said.start - 400]).max() < 1e-3
        levels.append(level_db_spl(heard[said.start + 800 : said.end - 800], SILENT))
    assert levels[0] == pytest.approx(71.0, abs=3.0)  # hardly more than the direct sound's
    assert levels[0] > levels[1] > levels[2] > 53.0 - 3.0  # the hall gives some back


def test_the_hall_decays_as_it_is_stated() -> None:
    pytest.importorskip("pyroomacoustics", reason="needs pyroomacoustics, of the eval extra")
    hall = Bench().hall
    assert decay_s(response(hall, 5.0)[0]) == pytest.approx(hall.rt60_s, rel=0.1)


@pytest.mark.slow
def test_a_block_of_calls_is_the_same_again_and_hears_near_and_not_far() -> None:
    pytest.importorskip("pyroomacoustics", reason="needs pyroomacoustics, of the eval extra")
    settings = {"text": calls.WAKE, "listeners": [listeners.OURS]}
    (near,) = calls.blocks("wake", 1, 2, [1.0], **settings, robot_noise_db_spl=50.0)
    (far,) = calls.blocks("wake", 1, 2, [10.0], **settings, robot_noise_db_spl=85.0)
    row = calls.call(near)
    assert row == calls.call(near)
    assert (row[listeners.OURS], calls.call(far)[listeners.OURS]) == (2, 0)


def test_blocks_hold_all_trials_once() -> None:
    found = calls.blocks("wake", 1, 45, [1.0, 2.0])
    for distance_m in (1.0, 2.0):
        assert sum(t.settings["calls"] for t in found if t.settings["distance_m"] == distance_m) == 45
    assert len({t.key for t in found}) == len(found)


def test_rows_of_one_step_are_added_up() -> None:
    row = {"distance_m": 1.0, "calls": 10, "listeners": ["a"], "a": 7, "a wrong": ["x"]}
    assert calls.step(1.0, "a", [row, {**row, "a": 9, "a wrong": []}]) == Step(1.0, 16, 20, 1)
    assert calls.step(2.0, "a", [{**row, "distance_m": 2.0}]) == Step(2.0, 7, 10, 1)
