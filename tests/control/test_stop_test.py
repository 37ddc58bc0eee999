"""`hvcpctl stop-test` in a room in virtual time: what was heard, how soon, and an honest verdict."""

from __future__ import annotations

import argparse
import asyncio
import json
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from hvcpd.config.settings import AudioSettings
from hvcpd.control.cli import make_parser
from hvcpd.control.doctor.self_hearing import SETTLE_S, exchange
from hvcpd.control.doctor.stop_test import LOUDNESSES_DB, Call, judged, run, voice_in
from hvcpd.control.simulate.team import load_team
from hvcpd.errors import DeviceError
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import voice_named
from tests.control.echo_room import EchoRoom
from tests.daemon.running import RunningRobot


def options(tmp_path: Path, *more: str) -> argparse.Namespace:
    (tmp_path / "hvcpd.yaml").write_text(f"name: Rob\nstate_dir: {tmp_path / 'state'}\n")
    return make_parser().parse_args(["stop-test", "--config", str(tmp_path / "hvcpd.yaml"), "--times", "1", *more])


@pytest.mark.slow
def test_loud_calls_halt_it_in_time_and_those_that_do_not_arrive_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(options(tmp_path, "--json"), EchoRoom(noise_rms=0.02).devices) == 1
    *calls, verdict = map(json.loads, capsys.readouterr().out.splitlines())
    assert [call["how"] for call in calls] == [f"{db:+.0f} dB" for db in LOUDNESSES_DB]
    assert calls[0]["over_noise_db"] is None, "28 dB below the noise"
    assert calls[-1]["over_noise_db"] > 5.0
    assert -0.4 < calls[-1]["halted_s"] <= 0.5
    assert calls[-1]["stopped_s"] is not None
    assert verdict["calls"] == len(calls)
    assert verdict["in_time"] < verdict["calls"]


def test_without_sound_nothing_arrives_and_it_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(options(tmp_path, "--ask"), EchoRoom(gain=0.0).devices) == 1
    told = capsys.readouterr()
    assert told.err.count('Say "stop"') == 3
    assert "0 of 3 calls halted the robot within 0.5 s (0 to 56 %" in told.out
    assert "3 did not arrive" in told.out
    assert "`hvcpctl doctor --only sound` looks" in told.out
    assert "not a safety device" in told.out


def test_a_robot_that_runs_is_told_to_disturb_the_test(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Beside a sound server both can use the card: the robot's own sentence was a call, 44 dB over the noise."""
    with RunningRobot(tmp_path):
        asked = options(tmp_path, "--ask")
        run(asked, EchoRoom(gain=0.0).devices)
    assert "Rob runs now" in capsys.readouterr().err


@pytest.mark.parametrize("how", [(), ("--ask",)])
def test_without_a_sound_card_there_is_no_table_and_nobody_is_asked_to_call(
    how: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def make_stream(_: object) -> NoReturn:
        raise DeviceError("there is no microphone on this machine")

    with pytest.raises(DeviceError):
        run(options(tmp_path, *how), replace(EchoRoom().devices, make_stream=make_stream))
    assert capsys.readouterr() == ("", "")


def test_the_prompt_comes_when_the_recording_begins_and_not_while_the_card_is_opened() -> None:
    """Who called at once was not heard."""
    played: list[int] = []
    stream = EchoRoom().devices.make_stream(AudioSettings())
    take = stream.read

    async def read() -> Samples:
        played.append(len(block := await take()))
        return block

    stream.read = read  # type: ignore[method-assign]
    asked_s: list[float] = []
    asyncio.run(exchange(stream, np.zeros(0, np.float32), 0.0, lambda: asked_s.append(sum(played) / SAMPLE_RATE_HZ)))
    assert asked_s == [pytest.approx(SETTLE_S, abs=0.03)]


def test_another_word_is_no_stop_and_a_halt_long_before_the_call_does_not_count(tmp_path: Path) -> None:
    team = load_team(options(tmp_path))
    rng = np.random.default_rng(1)
    for word, heard in (("stop", True), ("shop", None), ("water", False)):  # None: stands still, but for a moment only
        said = Speaker(voice_named("lark"), team.sound.lexicon).render([[word]])
        sound = np.pad(0.3 * said, (SAMPLE_RATE_HZ, 2 * SAMPLE_RATE_HZ))
        sound = np.asarray(sound + 1e-4 * rng.standard_normal(len(sound)), np.float32)
        ended_s = 1.0 + len(said) / SAMPLE_RATE_HZ
        call = judged(team, "loud", sound, ended_s, 20.0)
        assert heard is None or call.in_time is heard
        assert heard or call.stopped_s is None
        assert judged(team, "loud", sound, ended_s + 5.0, 20.0).halted_s is None


def test_the_end_of_a_voice_is_found_in_noise() -> None:
    noise = 0.01 * np.random.default_rng(2).standard_normal(4 * SAMPLE_RATE_HZ).astype(np.float32)
    assert voice_in(noise) is None
    noise[16_000:24_000] += 0.1 * np.sin(0.3 * np.arange(8_000)).astype(np.float32)
    found = voice_in(noise)
    assert found is not None
    assert found == (pytest.approx(1.5, abs=0.02), pytest.approx(17.1, abs=0.5))
    assert voice_in(noise + np.float32(0.1)) == pytest.approx(found, abs=0.1), "the call had not arrived"


@pytest.mark.parametrize("tap_s", [0.5, 3.0])
def test_a_tap_is_not_the_call(tap_s: float) -> None:
    """After one 2 s later a call that had halted the robot was told as one that had not; after one 0.6 s later a late
    halt was in time."""
    noise = 0.001 * np.random.default_rng(2).standard_normal(4 * SAMPLE_RATE_HZ).astype(np.float32)
    noise[16_000:24_000] += 0.1 * np.sin(0.3 * np.arange(8_000)).astype(np.float32)
    tap = round(tap_s * SAMPLE_RATE_HZ)
    noise[tap : tap + 800] += 0.3
    found = voice_in(noise)
    assert found is not None
    assert found[0] == pytest.approx(1.5, abs=0.02)


def test_calls_from_the_own_loudspeaker_are_told_as_such(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for more, told in (((), True), (("--output", "USB"), False), (("--ask",), False)):
        run(options(tmp_path, *more), EchoRoom(gain=0.0).devices)
        assert ("the robot's own loudspeaker" in capsys.readouterr().out) is told


@pytest.mark.parametrize(("halted_s", "in_time"), [(-0.1, True), (0.5, True), (0.51, False), (None, False)])
def test_half_a_second_is_in_time(halted_s: float | None, in_time: bool) -> None:
    assert Call("loudly", 20.0, halted_s).in_time is in_time
