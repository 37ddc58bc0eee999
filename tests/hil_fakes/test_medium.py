"""Open air and water: absorption by the books, delay, spreading; robots that met before they were set out."""

from __future__ import annotations

import numpy as np
import pytest

from hil_fakes.medium import WATER_M_S, Absorbing, air_db_m, taps, water_db_m
from hil_fakes.room import Air, DelayLine, FreeField, Room
from hvcpd.ports import SAMPLE_RATE_HZ

BLOCK = 400


@pytest.mark.parametrize(
    ("celsius", "humidity_percent", "db_km"),
    [
        (10.0, 70.0, [0.4, 1.0, 1.9, 3.7, 9.7, 32.8, 117.0]),
        (20.0, 70.0, [0.3, 1.1, 2.8, 5.0, 9.0, 22.9, 76.6]),
        (15.0, 20.0, [0.6, 1.2, 2.7, 8.2, 28.2, 88.8, 202.0]),
    ],
)
def test_air_absorbs_as_the_standards_table_has_it(celsius: float, humidity_percent: float, db_km: list[float]) -> None:
    """ISO 9613-2:1996, table 2: octaves from 125 Hz to 8 kHz."""
    exact = 1000.0 * 10.0 ** (0.3 * np.arange(-3.0, 4.0))
    assert 1000.0 * air_db_m(exact, celsius, humidity_percent) == pytest.approx(db_km, rel=0.01, abs=0.06)


def test_sea_water_absorbs_a_decibel_a_kilometre_at_10_khz() -> None:
    """Thorp's formula (JASA 42, 1967) is of another ocean of 4 °C; both agree within a third."""
    khz = np.array([1.0, 2.0, 5.0, 10.0])
    thorp_db_km = 1.0936 * (0.1 * khz**2 / (1 + khz**2) + 40 * khz**2 / (4100 + khz**2))
    assert 1000.0 * water_db_m(1000.0 * khz) == pytest.approx(thorp_db_km, rel=0.35)
    assert 1000.0 * water_db_m(np.array([10_000.0]))[0] == pytest.approx(0.98, abs=0.1)


@pytest.mark.parametrize(("absorption", "distance_m"), [(air_db_m, 180.0), (water_db_m, 2030.0)])
def test_filters_do_what_the_medium_does(absorption: object, distance_m: float) -> None:
    of = air_db_m if absorption is air_db_m else water_db_m
    hz = np.fft.rfftfreq(1024, 1.0 / SAMPLE_RATE_HZ)
    speech = (hz > 300.0) & (hz < 6000.0)
    level_db = 20.0 * np.log10(np.abs(np.fft.rfft(taps(of, distance_m), 1024)))
    np.testing.assert_allclose(level_db[speech], -of(hz)[speech] * distance_m, atol=0.1)


@pytest.mark.parametrize("distance_m", [200.0, 2030.0])
def test_sound_comes_late_and_weak_from_far_away(distance_m: float) -> None:
    way = Absorbing(WATER_M_S, 2500.0, water_db_m)
    line = DelayLine(way.reach)
    sound = np.sin(2 * np.pi * 1000.0 * np.arange(2 * BLOCK) / SAMPLE_RATE_HZ).astype(np.float32)
    heard = []
    for k in range(60):
        line.write(sound[k * BLOCK : (k + 1) * BLOCK] if k < 2 else np.zeros(BLOCK, np.float32))
        heard.append(way.carry(line, BLOCK, distance_m, distance_m, 1.0))
    arrived = np.concatenate(heard)
    loud = np.flatnonzero(np.abs(arrived) > 0.3 * np.abs(arrived).max())
    assert loud[0] == pytest.approx(distance_m / WATER_M_S * SAMPLE_RATE_HZ, abs=8)
    steady = arrived[loud[0] + 200 : loud[0] + 520]  # 20 periods
    expected_db = -20.0 * np.log10(distance_m) - water_db_m(np.array([1000.0]))[0] * distance_m
    assert 20.0 * np.log10(np.sqrt(2.0) * np.std(steady)) == pytest.approx(expected_db, abs=0.2)


def test_nothing_is_heard_of_the_way_on_which_a_robot_was_carried() -> None:
    room = Room(2, Air(noise_db_spl=-20.0), 1, ways=FreeField(343.0, 400.0))
    tone = (0.3 * np.sin(2 * np.pi * 0.02 * np.arange(BLOCK))).astype(np.float32)
    quiet = np.zeros(BLOCK, np.float32)
    room.advance([tone, quiet], [(0.0, 0.0), (1.0, 0.0)])
    near = room.advance([tone, quiet], [(0.0, 0.0), (1.0, 0.0)])[1]
    far = room.advance([tone, quiet], [(0.0, 0.0), (300.0, 0.0)])[1]
    assert np.abs(near).max() > 1e-3
    assert np.abs(far).max() < 1e-4
