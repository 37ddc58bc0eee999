"""`hvcpctl calibrate` in a room in virtual time, with and without a mixer."""

import argparse
import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hil_fakes.loudspeakers import SMALL, Loudspeaker, Peak
from hvcpd.control.cli import make_parser
from hvcpd.control.doctor.calibrate import run
from hvcpd.control.doctor.mixer import Control, capture_control
from hvcpd.errors import DeviceError
from hvcpd.hardware.acoustics import clipped_share, find_echo, find_response, level_dbfs, predicted_range_m
from hvcpd.ports import SAMPLE_RATE_HZ
from tests.control.echo_room import EchoRoom
from tests.daemon.running import RunningRobot


def options(tmp_path: Path, *more: str) -> argparse.Namespace:
    (tmp_path / "hvcpd.yaml").write_text(f"name: Rob\nstate_dir: {tmp_path / 'state'}\n")
    return make_parser().parse_args(["calibrate", "--config", str(tmp_path / "hvcpd.yaml"), *more])


@pytest.mark.slow
@pytest.mark.parametrize("gain", [0.03, 20.0], ids=["too soft", "clipping"])
def test_the_mixer_is_set_so_that_the_own_voice_just_does_not_clip(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], gain: float
) -> None:
    room = EchoRoom(gain=gain, noise_rms=0.0001)
    assert run(options(tmp_path), room.devices, room.amixer, lambda: 1e9) == 0
    kept = json.loads((tmp_path / "state" / "calibration.json").read_text())
    assert -9.5 <= kept["own_peak_dbfs"] <= -3.0
    assert kept["date"] == "2001-09-09"
    assert kept["understood"]
    assert "microphone gain +0.0 dB ->" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("device", "mixer"), [("USB Audio: - (hw:1,0)", "hw:1"), ("default", "default"), ("pipewire", None)]
)
def test_the_default_device_has_the_mixer_of_the_card_that_asound_conf_names(device: str, mixer: str | None) -> None:
    asked: list[Sequence[str]] = []

    def amixer(command: Sequence[str]) -> str:
        asked.append(command)
        return "Simple mixer control 'Mic',0\n"

    assert capture_control(amixer, device) == (Control(amixer, mixer, "Mic") if mixer is not None else None)
    assert asked == ([("amixer", "-D", mixer, "scontrols")] if mixer is not None else [])


@pytest.mark.slow
def test_without_a_mixer_it_says_what_to_change_and_keeps_nothing_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    room = EchoRoom(gain=0.03, loudspeaker=SMALL)
    assert run(options(tmp_path, "--dry-run"), room.devices, lambda _command: None) == 0
    out = capsys.readouterr().out
    assert "should change by +" in out
    assert "no mixer control" in out
    found = re.search(r"sounds from (\d+) Hz on and resonates at (\d+) Hz, by (\d+) dB", out)
    assert found is not None, out
    lowest_hz, resonance_hz, gain_db = map(int, found.groups())
    assert 300 <= lowest_hz <= 500, "its corner is at 400 Hz"
    assert resonance_hz == pytest.approx(900, rel=0.13), "within a sixth of an octave"
    assert 4 <= gain_db <= 9
    assert not (tmp_path / "state").exists()


@pytest.mark.slow
def test_a_robot_that_does_not_hear_itself_is_not_calibrated(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="does not hear itself"):
        run(options(tmp_path), EchoRoom(gain=0.0).devices, lambda _command: None)


@pytest.mark.slow
def test_no_reach_is_predicted_from_digital_silence(tmp_path: Path) -> None:
    """A microphone that suppresses noise had a peer understood up to 10 km, and that was kept."""
    with pytest.raises(DeviceError, match="digital silence"):
        run(options(tmp_path), EchoRoom(noise_rms=0.0).devices, lambda _command: None)
    assert not (tmp_path / "state" / "calibration.json").exists()


@pytest.mark.slow
def test_what_was_measured_in_a_din_takes_the_place_of_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The robot did not understand itself; that was kept, and the doctor found it well."""
    kept = tmp_path / "state" / "calibration.json"
    kept.parent.mkdir()
    kept.write_text("{}")
    assert run(options(tmp_path), EchoRoom(noise_rms=0.4).devices, lambda _command: None) == 1
    assert "hvcpctl doctor --only sound tells why\nnothing was kept" in capsys.readouterr().out
    assert kept.read_text() == "{}"


def test_a_robot_that_runs_now_must_be_ended_first(tmp_path: Path) -> None:
    """Beside a sound server both can use the card: its talk counted as noise, and that was kept."""
    with RunningRobot(tmp_path), pytest.raises(DeviceError, match="Rob runs now, and its talk would count as noise"):
        run(options(tmp_path), EchoRoom().devices, lambda _command: None)


@settings(max_examples=20)
@given(st.floats(200.0, 1500.0), st.floats(6.0, 12.0), st.integers(0, 5))
@example(1400.0, 12.0, 0)  # read as 8.7 dB while it lifted the middle that it is compared with
def test_a_resonance_is_found_to_a_sixth_of_an_octave(hz: float, gain_db: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    played = (0.1 * rng.standard_normal(32_000)).astype(np.float32)
    heard = 0.3 * Loudspeaker("", peaks=(Peak(hz, gain_db, 3.0),)).play(played)[: played.size]
    found = find_response(played, (heard + 1e-3 * rng.standard_normal(played.size)).astype(np.float32))
    assert found is not None
    assert found.resonance_hz == pytest.approx(hz, rel=0.13)
    assert gain_db - 3.0 < found.resonance_db < gain_db + 2.0


def test_a_flat_loudspeaker_has_no_resonance_and_noise_no_response() -> None:
    rng = np.random.default_rng(1)
    played, noise = (rng.standard_normal(32_000).astype(np.float32) for _ in range(2))
    found = find_response(played, 0.1 * played)
    assert found is not None
    assert found.resonance_hz is None
    assert find_response(played, noise) is None
    assert find_response(played, noise[:0]) is None


def test_a_buzzer_that_has_nothing_below_2_khz_has_no_resonance() -> None:
    rng = np.random.default_rng(1)
    played, noise = rng.standard_normal((2, 32_000))
    is_high = np.fft.rfftfreq(32_000, 1.0 / SAMPLE_RATE_HZ) > 2300.0
    high, low = np.fft.rfft(played) * is_high, np.fft.rfft(noise) * ~is_high
    found = find_response(played.astype(np.float32), np.fft.irfft(high + low).astype(np.float32))
    assert found is not None
    assert found.lowest_hz > 2000.0
    assert found.resonance_hz is None


@settings(max_examples=20)
@given(st.integers(0, 8000), st.floats(-40.0, 0.0), st.integers(0, 5))
def test_an_echo_is_found_to_the_sample_and_its_level_to_a_decibel(delay: int, gain_db: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    played = (0.1 * rng.standard_normal(16000)).astype(np.float32)
    noise = (1e-4 * rng.standard_normal(42000)).astype(np.float32)
    heard = noise[16000:].copy()
    heard[delay : delay + len(played)] += np.float32(10.0 ** (gain_db / 20.0)) * played
    echo = find_echo(played, heard, noise[:16000])
    assert echo is not None
    assert round(echo.delay_s * 16000) == delay
    assert echo.level_dbfs == pytest.approx(-20.0 + gain_db, abs=1.0)
    assert echo.snr_db == pytest.approx(60.0 + gain_db, abs=1.5)


@pytest.mark.parametrize("seed", range(20))
def test_noise_alone_is_no_echo(seed: int) -> None:
    rng = np.random.default_rng(seed)
    played, heard = (0.1 * rng.standard_normal(n) for n in (16000, 60000))
    assert find_echo(played.astype(np.float32), heard.astype(np.float32), heard[:8000].astype(np.float32)) is None


def test_levels_clipping_and_range() -> None:
    tone = np.sin(np.arange(16000) * 0.1).astype(np.float32)
    assert level_dbfs(tone) == pytest.approx(-3.01, abs=0.01)
    assert level_dbfs(np.zeros(100, np.float32)) == -120.0
    assert clipped_share(np.array([1.0, -1.0, 0.5, 0.0], np.float32)) == 0.5
    assert predicted_range_m(-20.0, 0.1, -60.0) == pytest.approx(10.0)
