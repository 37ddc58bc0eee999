"""The worlds of the hearing benchmark: each part does to sound what it says, and verdicts are what was said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.ablation.__main__ import Change, change
from benchmarks.ablation.mechanisms import ALL, SOURCES, Mechanism
from benchmarks.ablation.switches import answering, defaults, instead
from benchmarks.hearing.material import Spoken, make_team
from benchmarks.hearing.mixing import speech_rms
from benchmarks.hearing.worlds import microphones, ordinary, rooms, stages
from benchmarks.hearing.worlds.conditions import conditions
from benchmarks.hearing.worlds.microphones import Microphone
from benchmarks.hearing.worlds.sounds import per_hour
from benchmarks.hearing.worlds.trials import Tally, Trial, Verdict, judged
from benchmarks.hearing.worlds.world import World, draw_world
from hil_fakes import reverberation
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition import frontend, template_recogniser
from hvcpd.recognition.events import Event, Recognised, Source, Urgent, WordSpan
from hvcpd.recognition.shared_front_end import SharedFrontEnd
from hvcpd.recognition.template_recogniser import RecogniserSettings

needs_rooms = pytest.mark.skipif(not reverberation.available(), reason="needs pyroomacoustics")


def noise(n: int, rms: float = 0.1) -> NDArray[np.float64]:
    return rms * np.random.default_rng(2).standard_normal(n)


def level_db(sound: NDArray[np.floating]) -> float:
    return 10.0 * float(np.log10(np.mean(np.square(sound, dtype=np.float64))))


def test_a_clock_and_a_drive_stretch_the_sound_as_they_should() -> None:
    hz, n = 3000.0, 2 * SAMPLE_RATE_HZ
    tone = np.sin(2.0 * np.pi * hz * np.arange(n) / SAMPLE_RATE_HZ).astype(np.float32)
    steady = slice(SAMPLE_RATE_HZ // 4, -SAMPLE_RATE_HZ // 4)
    for world, ratio in ((World(ppm=1300.0), 1.0 - 1300e-6), (World(speed_m_s=0.44), 1.0 + 0.44 / 343.0)):
        heard = world.carried(tone)[steady]
        assert level_db(heard) == pytest.approx(level_db(tone), abs=0.05)
        expected = np.exp(-2j * np.pi * hz * ratio * np.arange(len(heard)) / SAMPLE_RATE_HZ)
        turns = np.unwrap(np.angle(np.add.reduceat(heard * expected, np.arange(0, len(heard), 160)))) / (2.0 * np.pi)
        assert abs(turns[-2] - turns[0]) < 0.02, "another pitch"
        [moved] = world.when([Spoken(("hi",), SAMPLE_RATE_HZ, n - 1000)], n)
        assert moved.end - moved.start == pytest.approx((n - 1000 - SAMPLE_RATE_HZ) / ratio, abs=2)


def test_the_codec_gives_back_what_it_gets_but_for_its_bits_and_its_band() -> None:
    sound = noise(SAMPLE_RATE_HZ)
    assert level_db(microphones.coded(sound, 16, 8000.0) - sound) < level_db(sound) - 80.0
    assert level_db(microphones.coded(sound, 5, 8000.0) - sound) == pytest.approx(level_db(sound) - 28.0, abs=3.0)
    cut = np.abs(np.fft.rfft(microphones.coded(sound, 16, 5000.0))) ** 2
    assert cut[5300:].sum() < 1e-3 * cut[:5000].sum()


def test_gain_control_and_noise_suppression_do_their_work() -> None:
    faint, loud = (microphones.controlled(noise(4 * SAMPLE_RATE_HZ, rms)) for rms in (0.01, 0.3))
    for sound in (faint, loud):
        assert level_db(sound[-SAMPLE_RATE_HZ:]) == pytest.approx(-23.0, abs=1.0)
    hiss = noise(5 * SAMPLE_RATE_HZ, 0.01)
    tone = hiss.copy()
    tone[3 * SAMPLE_RATE_HZ :] += 0.2 * np.sin(2.0 * np.pi * 1000.0 * np.arange(2 * SAMPLE_RATE_HZ) / SAMPLE_RATE_HZ)
    quieter = microphones.suppressed(tone, 12.0)
    before = slice(2 * SAMPLE_RATE_HZ, 3 * SAMPLE_RATE_HZ)
    assert level_db(quieter[before]) < level_db(hiss[before]) - 8.0
    during = slice(3 * SAMPLE_RATE_HZ + 4000, 4 * SAMPLE_RATE_HZ)
    assert level_db(quieter[during]) == pytest.approx(level_db(tone[during]), abs=0.5)


@needs_rooms
def test_a_simulated_room_is_kept_and_has_the_ratio_that_was_asked_for(tmp_path: Path) -> None:
    place = rooms.Place(rooms.Box((4.0, 3.0, 2.5), 0.3), 2.0, 5, 0.0, -9.0)
    found = rooms.response(place, tmp_path)
    assert rooms.acoustic(found).drr_db == pytest.approx(-9.0, abs=0.1)
    assert rooms.acoustic(found).rt60_s == pytest.approx(0.3, abs=0.08)
    assert np.sum(found.astype(np.float64) ** 2) == pytest.approx(1.0, rel=1e-4)
    [file] = tmp_path.iterdir()
    np.save(file, 2.0 * found)
    rooms.response.cache_clear()
    np.testing.assert_allclose(rooms.response(place, tmp_path), 2.0 * found)


def test_noise_comes_at_the_ratio_that_was_asked_for() -> None:
    team = make_team(("Mia", "Ted"))
    spoken = [Spoken(("hi",), SAMPLE_RATE_HZ, 2 * SAMPLE_RATE_HZ)]
    speech = np.zeros(3 * SAMPLE_RATE_HZ, np.float32)
    speech[SAMPLE_RATE_HZ : 2 * SAMPLE_RATE_HZ] = noise(SAMPLE_RATE_HZ)
    world = World(noise="white", snr_db=-5.0, level_dbfs=-30.0, seed=3)
    heard = world.heard(world.carried(speech), spoken, team)
    quiet = world.heard(np.asarray(speech, np.float64) * 1.0, spoken, team)
    np.testing.assert_allclose(heard, quiet, atol=1e-4)
    assert level_db(heard[:SAMPLE_RATE_HZ]) == pytest.approx(-25.0, abs=0.2)
    both = 10.0 * np.log10(10.0**-3.0 + 10.0**-2.5)
    assert level_db(heard[SAMPLE_RATE_HZ : 2 * SAMPLE_RATE_HZ]) == pytest.approx(both, abs=0.2)
    assert speech_rms(speech, spoken) == pytest.approx(0.1, rel=0.02)


def test_worlds_are_drawn_from_their_seed_within_their_bounds() -> None:
    worlds = [draw_world(seed) for seed in range(60)]
    assert worlds == [draw_world(seed) for seed in range(60)]
    assert len({(w.noise, w.snr_db) for w in worlds}) == 60
    assert all(-10.0 <= w.snr_db <= 20.0 and abs(w.ppm) <= 1300.0 and abs(w.speed_m_s) <= 0.44 for w in worlds)
    places = [w.room for w in worlds if isinstance(w.room, rooms.Place)]
    assert all(0.2 <= place.box.rt60_s <= 2.3 for place in places)
    assert any(w.microphone != Microphone() for w in worlds)
    assert {w.room is None for w in worlds} == {True, False}


def test_every_condition_has_a_name_of_its_own_and_another_seed_other_rooms() -> None:
    here, there = conditions(1, None), conditions(2, None)
    assert len({c.name for c in here}) == len(here)
    for one, other in zip(here, there, strict=True):
        first, second = one.make(100_000).room, other.make(200_000).room
        assert first is None or first != second


def told(words: str, start: int, end: int, voice: str = "oak", at: int = 160) -> Recognised:
    return Recognised(tuple(words.split()), voice, start, end, 0.9, 10.0, (WordSpan("hi", at, at + 160, 0.9),))


FIRST, SECOND = Spoken(("hi", "rob"), 100_000, 110_000), Spoken(("stop",), 105_000, 112_000)


@pytest.mark.parametrize(
    ("events", "outcomes"),
    [
        ([], ["lost", "lost"]),
        ([told("hi rob", 100_100, 109_000)], ["right", "lost"]),
        ([told("hi rob", 100_100, 109_000), Urgent(105_000, 109_000)], ["right", "right"]),
        ([told("hi bot", 100_100, 104_000), told("stop", 105_100, 112_000)], ["wrong", "right"]),
        ([told("hi rob", 100_100, 109_000), told("all stop", 109_500, 112_000)], ["right", "wrong"]),
        ([told("hi bot", 10_000, 20_000)], ["lost", "lost"]),
    ],
)
def test_two_at_once_are_judged_each_for_itself_from_where_scoring_begins(
    events: list[Event], outcomes: list[str]
) -> None:
    trial = Trial(np.zeros(1, np.float32), 50_000, (FIRST, SECOND))
    assert [v.outcome for v in judged(events, trial)] == outcomes


def test_a_stop_that_nobody_said_is_wrong_and_sources_are_told_apart() -> None:
    trial = Trial(np.zeros(1, np.float32), 0, (FIRST,))
    [verdict] = judged([told("hi rob", 100_100, 109_000), Urgent(105_000, 109_000)], trial)
    assert verdict.outcome == "wrong"
    assert [source for source, _ in verdict.instead] == ["urgent"]
    event = told("hi rob", 100_000, 109_000)
    sources = [judged([replace(event, source=source)], trial)[0].source for source in Source]
    assert sources == [str(source) for source in Source]


@pytest.mark.parametrize("recipe", ordinary.RECIPES, ids=lambda recipe: recipe.name)
def test_every_ordinary_sound_is_one(recipe: ordinary.Recipe) -> None:
    clips = [ordinary.clip(recipe, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert np.all(np.isfinite(clips[0]))
    assert np.mean(clips[0] ** 2) == pytest.approx(1.0)
    np.testing.assert_array_equal(clips[0], clips[1])
    assert not np.array_equal(clips[0], clips[2])


def test_rates_have_the_intervals_of_the_tables() -> None:
    assert per_hour(0, 1.0) == "0.0 an hour (0.0-3.7)"  # Garwood 1936, table: 3.689
    assert per_hour(10, 2.0) == "5.0 an hour (2.4-9.2)"  # 4.795 and 18.390


def test_what_is_switched_off_is_put_back() -> None:
    assert RecogniserSettings().min_gain == 16.0
    with defaults("hvcpd.recognition.template_recogniser:RecogniserSettings", min_gain=3.0)():
        assert RecogniserSettings().min_gain == 3.0
        assert RecogniserSettings(min_gain=4.0).min_gain == 4.0
    assert RecogniserSettings().min_gain == 16.0
    with answering("hvcpd.recognition.template_recogniser:RecogniserSettings.__repr__", "none")():
        assert repr(RecogniserSettings()) == "none"
    assert repr(RecogniserSettings()) != "none"
    with instead("hvcpd.recognition.network:Beam", None)():
        assert getattr(template_recogniser, "Beam", 1) is None, "who imported the name has it too"
    assert RecogniserSettings().beam is not None
    no_setting = defaults("hvcpd.recognition.template_recogniser:RecogniserSettings", x=1)
    for gone in (instead("hvcpd.recognition.nowhere:X", 1), no_setting):
        with pytest.raises(LookupError), gone():
            pass


@pytest.mark.parametrize("mechanism", ALL, ids=lambda mechanism: mechanism.name)
def test_there_is_every_mechanism_that_can_be_switched_off(mechanism: Mechanism) -> None:
    with mechanism.without():
        pass
    assert mechanism.lines > 0 or mechanism not in SOURCES


def test_a_change_is_as_sure_as_mcnemars_test_has_it() -> None:
    def tally(outcomes: str) -> Tally:
        names = {"r": "right", "w": "wrong", "l": "lost"}
        return Tally([Verdict(("hi",), names[letter]) for letter in outcomes])

    found = change(tally("rrrrrrrrll"), tally("llllllrrrl"), "right")
    assert found == Change(6, 1)
    assert found.p == pytest.approx(0.125)  # two-sided binomial of 1 in 7
    assert Change(6, 0).p == pytest.approx(0.03125)
    assert Change(0, 0).p == 1.0


def test_the_time_of_each_stage_is_counted_while_it_is_asked_for_and_then_no_more() -> None:
    before = frontend.energies_of
    front_end, sound = SharedFrontEnd(), np.asarray(noise(2 * SAMPLE_RATE_HZ), np.float32)
    with stages.timed() as spent:
        for chunk in front_end.push(sound, False):
            front_end.noise.push(chunk.energies)
    assert spent["front end"] > 0.0
    assert spent["noise"] > 0.0
    assert spent["channel search"] == spent["people"] == 0.0
    told = dict(spent)
    for chunk in front_end.push(sound, False):
        front_end.noise.push(chunk.energies)
    assert spent == told
    assert frontend.energies_of is before
