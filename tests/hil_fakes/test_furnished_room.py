"""Loudspeakers and a furnished room on the bench: what they do to sound, checked against figures from elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from hil_fakes.furnished_room import FurnishedRoom, Furniture, Wall
from hil_fakes.loudspeakers import GOOD, IDEAL, LOUD, SMALL, SMALL_DISTORTING, USUAL, Loudspeaker, Peak, Playing
from hil_fakes.reverberation import decay_s
from hil_fakes.room import Air, DelayLine, FreeField, Room
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

BLOCK = 400


def tone(hz: float, amplitude: float = 0.1, n: int = SAMPLE_RATE_HZ) -> Samples:
    return np.asarray(amplitude * np.sin(2.0 * np.pi * hz * np.arange(n) / SAMPLE_RATE_HZ), np.float32)


def level_db(loudspeaker: Loudspeaker, hz: float) -> float:
    played = loudspeaker.play(tone(hz))[SAMPLE_RATE_HZ // 2 :]
    return 20.0 * float(np.log10(np.sqrt(2.0 * np.mean(played**2)) / 0.1))


def test_a_loudspeaker_has_its_corners_slopes_and_resonance() -> None:
    plain = Loudspeaker("plain", 400.0, 4, 6000.0, 2, (Peak(900.0, 8.0, 2.0),))
    assert level_db(Loudspeaker("high-pass", 400.0, 4), 400.0) == pytest.approx(-3.0, abs=0.1)
    assert level_db(Loudspeaker("high-pass", 400.0, 4), 200.0) == pytest.approx(-24.0, abs=1.0)  # 24 dB an octave
    assert level_db(plain, 900.0) == pytest.approx(8.0, abs=0.2)
    assert level_db(Loudspeaker("low-pass", high_hz=4000.0, high_order=2), 4000.0) == pytest.approx(-3.0, abs=0.1)
    assert level_db(IDEAL, 50.0) == pytest.approx(0.0, abs=1e-3)


def test_distortion_is_what_it_is_called() -> None:
    played = Loudspeaker("distorting", distortion=0.05).play(tone(500.0, LOUD))
    lines = np.abs(np.fft.rfft(played))[[500, 1000, 1500]]
    assert np.hypot(lines[1], lines[2]) / lines[0] == pytest.approx(0.05, rel=0.02)
    assert lines[1] == pytest.approx(lines[2], rel=0.02)


@given(st.lists(st.integers(1, 700), min_size=1, max_size=6), st.sampled_from([GOOD, USUAL, SMALL, SMALL_DISTORTING]))
def test_blocks_of_any_size_play_the_same(sizes: list[int], loudspeaker: Loudspeaker) -> None:
    sound = np.random.default_rng(3).standard_normal(sum(sizes)).astype(np.float32) * np.float32(0.1)
    playing = Playing(loudspeaker)
    blocks = [playing.play(block) for block in np.split(sound, np.cumsum(sizes)[:-1])]
    np.testing.assert_allclose(np.concatenate(blocks), loudspeaker.play(sound), atol=1e-12)


def test_a_loudspeaker_falls_silent() -> None:
    playing = Playing(USUAL)
    assert np.any(playing.play(tone(1000.0, n=BLOCK)))
    blocks = [playing.play(np.zeros(BLOCK, np.float32)) for _ in range(8)]
    assert np.any(blocks[0])
    assert not np.any(blocks[-1]), "what never is silent costs the room its time"


def response(ways: FurnishedRoom | FreeField, distance_m: float) -> NDArray[np.float64]:
    """What arrives of one sample of 1."""
    line, heard = DelayLine(ways.reach), []
    for k in range(40):
        block = np.zeros(BLOCK, np.float32)
        block[0] = float(k == 0)
        line.write(block)
        heard.append(ways.carry(line, BLOCK, distance_m, distance_m, 1.0))
    return np.concatenate(heard)


def test_the_room_decays_as_long_as_it_says_and_is_as_diffuse_as_its_size_makes_it() -> None:
    furniture = Furniture()
    impulse = response(FurnishedRoom(furniture), 4.0)
    direct = int(np.argmax(np.abs(impulse)))
    assert direct == pytest.approx(4.0 / 343.0 * SAMPLE_RATE_HZ, abs=2)
    assert decay_s(np.asarray(impulse[direct:], np.float32)) == pytest.approx(furniture.rt60_s, rel=0.25)
    tail = impulse - response(FurnishedRoom(Furniture(rt60_s=0.02)), 4.0)  # which has no tail
    at_critical = 1.0 / furniture.critical_m**2
    share = 10.0 ** (-6.0 * furniture.tail_from_s / furniture.rt60_s)
    assert np.sum(tail**2) == pytest.approx(share * at_critical, rel=0.1)


@pytest.mark.parametrize("distance_m", [5.0, 8.0, 10.0, 12.0])
def test_nothing_arrives_before_the_direct_sound(distance_m: float) -> None:
    impulse = np.abs(response(FurnishedRoom(), distance_m))
    direct = math.floor(distance_m / 343.0 * SAMPLE_RATE_HZ)
    assert impulse[: direct - 20].max() < 1e-3 * impulse[direct - 2 : direct + 3].max()
    assert impulse[direct + 100 :].any()


def test_a_wall_is_a_mirror() -> None:
    wall = Wall(aside_m=3.0, behind_m=0.0, reflects=0.5)
    impulse = response(FurnishedRoom(Furniture((wall,), rt60_s=0.02)), 4.0)
    np.testing.assert_allclose(impulse, response(FreeField(), 4.0) + 0.5 * response(FreeField(), 5.0), atol=1e-9)


def test_the_room_falls_silent_when_the_last_echo_has_passed() -> None:
    ways = FurnishedRoom()
    line = DelayLine(ways.reach)
    line.write(tone(1000.0, n=BLOCK))
    sounds = []
    while not line.is_silent(BLOCK, ways.latest(5.0)):
        sounds.append(bool(np.any(ways.carry(line, BLOCK, 5.0, 5.0, 1.0))))
        line.write(np.zeros(BLOCK, np.float32))
        assert len(sounds) < 100
    assert not np.any(np.abs(ways.carry(line, BLOCK, 5.0, 5.0, 1.0)) > 1e-9)
    assert len(sounds) - sounds.index(False, sounds.index(True)) <= 2, "it is not listened to for nothing"


def test_robots_hear_each_other_through_loudspeaker_and_room_and_themselves_without_echo() -> None:
    quiet = Air(noise_db_spl=-40.0)
    click = np.zeros(BLOCK, np.float32)
    click[0] = 0.5
    blocks = [click, *[np.zeros(BLOCK, np.float32)] * 12]
    heard = {}
    for name, ways in (("open", None), ("furnished", FurnishedRoom())):
        room = Room(2, quiet, 1, ways=ways, loudspeaker=USUAL)
        takes = [room.advance([block, blocks[-1]], [(0.0, 0.0), (3.0, 0.0)]) for block in blocks]
        heard[name] = [np.concatenate([take[ear] for take in takes]) for ear in (0, 1)]
    np.testing.assert_array_equal(heard["open"][0], heard["furnished"][0])
    late = slice(int(0.1 * SAMPLE_RATE_HZ), None)
    assert not np.any(np.abs(heard["open"][1][late]) > 2e-5)
    assert np.sum(heard["furnished"][1][late] ** 2) > 0.0
