"""`hvcpctl stop-test` in a room in virtual time: what was heard, how soon, and an honest verdict."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from hvcpd.control.cli import make_parser
from hvcpd.control.doctor.stop_test import LOUDNESSES_DB, Call, judged, run, voice_in
from hvcpd.control.simulate.team import load_team
from hvcpd.errors import DeviceError
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import voice_named
from tests.control.echo_room import EchoRoom


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
    assert "not a safety device" in told.out


def test_without_a_sound_card_there_is_no_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def make_stream(_: object) -> NoReturn:
        raise DeviceError("there is no microphone on this machine")

    with pytest.raises(DeviceError):
        run(options(tmp_path), replace(EchoRoom().devices, make_stream=make_stream))
    assert capsys.readouterr().out == ""


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


@pytest.mark.parametrize(("halted_s", "in_time"), [(-0.1, True), (0.5, True), (0.51, False), (None, False)])
def test_half_a_second_is_in_time(halted_s: float | None, in_time: bool) -> None:
    assert Call("loudly", 20.0, halted_s).in_time is in_time
