"""WAV files of every common kind, and every way in which they are broken."""

from __future__ import annotations

import io
import os
import platform
import struct
import subprocess
import sys
import tempfile
import threading
import wave
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import soundfile
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from hvcpd.control.cli import main
from hvcpd.errors import AudioFileError
from hvcpd.hardware.soundfile import read_wav, write_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from tests.control.conftest import Ran, Refuse

PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
Encode = Callable[[NDArray[np.float64]], bytes]


def _24_bit(x: NDArray[np.float64]) -> bytes:
    whole = np.rint(x * (2**23 - 1)).astype("<i4")
    return whole.view(np.uint8).reshape(-1, 4)[:, :3].tobytes()


KINDS: dict[str, tuple[int, int, Encode, float]] = {
    "8 bit": (PCM, 8, lambda x: np.rint(x * 127 + 128).astype(np.uint8).tobytes(), 2**-6),
    "16 bit": (PCM, 16, lambda x: np.rint(x * 32767).astype("<i2").tobytes(), 2**-14),
    "24 bit": (PCM, 24, _24_bit, 2**-21),
    "32 bit": (PCM, 32, lambda x: np.rint(x * (2**31 - 1)).astype("<i4").tobytes(), 1e-6),
    "float": (FLOAT, 32, lambda x: x.astype("<f4").tobytes(), 1e-6),
    "double": (FLOAT, 64, lambda x: x.astype("<f8").tobytes(), 1e-6),
}


def riff(
    data: bytes,
    code: int = PCM,
    bits: int = 16,
    rate_hz: int = SAMPLE_RATE_HZ,
    channels: int = 1,
    *,
    extensible: bool = False,
    before: bytes = b"",
    stated: int | None = None,
) -> bytes:
    """A WAV file written by the specification, independently of `write_wav`."""
    frame = channels * bits // 8
    fmt = struct.pack("<HHIIHH", EXTENSIBLE if extensible else code, channels, rate_hz, rate_hz * frame, frame, bits)
    if extensible:
        fmt += struct.pack("<HHIH", 22, bits, 0, code) + bytes.fromhex("000000001000800000aa00389b71")
    length = len(data) if stated is None else stated
    body = b"WAVE" + b"fmt " + struct.pack("<I", len(fmt)) + fmt + before
    body += b"data" + struct.pack("<I", length) + data
    return b"RIFF" + struct.pack("<I", len(body)) + body


def tone(rate_hz: int, duration_s: float = 0.25) -> NDArray[np.float64]:
    return 0.5 * np.sin(2 * np.pi * 440.0 * np.arange(round(duration_s * rate_hz)) / rate_hz)


def read(tmp_path: Path, data: bytes) -> Samples:
    path = tmp_path / "x.wav"
    path.write_bytes(data)
    return read_wav(path)


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_sample(kind: str, extensible: bool, tmp_path: Path) -> None:
    code, bits, encode, step = KINDS[kind]
    wanted = tone(SAMPLE_RATE_HZ)
    got = read(tmp_path, riff(encode(wanted), code, bits, extensible=extensible))
    assert got.dtype == np.float32
    np.testing.assert_allclose(got, wanted, atol=step)


@pytest.mark.parametrize(("kind", "atol"), [("GSM610", 0.2), ("G721_32", 0.05)])
def test_compressed_samples_in_which_nobody_can_seek(kind: str, atol: float, tmp_path: Path) -> None:
    """What telephone systems record was told as "this is not a file name"."""
    soundfile.write(tmp_path / "x.wav", tone(8_000), 8_000, kind)
    got = read_wav(tmp_path / "x.wav")[:4_000]
    np.testing.assert_allclose(got[800:-800], tone(SAMPLE_RATE_HZ)[800:-800], atol=atol)


@pytest.mark.parametrize("rate_hz", [8_000, 11_025, 22_050, 32_000, 44_100, 48_000, 96_000])
def test_every_rate_becomes_16_khz(rate_hz: int, tmp_path: Path) -> None:
    got = read(tmp_path, riff(KINDS["float"][2](tone(rate_hz)), FLOAT, 32, rate_hz))
    wanted = tone(SAMPLE_RATE_HZ)[: len(got)]
    assert len(got) == pytest.approx(len(wanted), abs=1)
    inner = slice(400, -400)
    np.testing.assert_allclose(got[inner], wanted[inner], atol=2e-4)


@pytest.mark.parametrize("quieter", [0.95, 0.9])
def test_of_channels_that_cancel_the_louder_one_is_heard(quieter: float, tmp_path: Path) -> None:
    one = np.linspace(-0.5, 0.5, 1000)
    frames = np.stack([-quieter * one, one], axis=1)
    np.testing.assert_allclose(read(tmp_path, riff(KINDS["16 bit"][2](frames.ravel()), channels=2)), one, atol=1e-4)


@pytest.mark.parametrize("channels", [2, 6])
def test_channels_are_averaged(channels: int, tmp_path: Path) -> None:
    frames = np.zeros((1000, channels))
    frames[:, 0] = 0.6
    got = read(tmp_path, riff(KINDS["16 bit"][2](frames.ravel()), channels=channels))
    np.testing.assert_allclose(got, 0.6 / channels, atol=1e-4)


@pytest.mark.parametrize("format_", ["FLAC", "AIFF", "OGG"])
def test_other_formats_are_read_by_their_contents(format_: str, tmp_path: Path) -> None:
    wanted = tone(SAMPLE_RATE_HZ)
    data = io.BytesIO()
    soundfile.write(data, wanted, SAMPLE_RATE_HZ, format=format_)
    np.testing.assert_allclose(read(tmp_path, data.getvalue()), wanted, atol=0.02 if format_ == "OGG" else 1e-4)
    if format_ == "AIFF":
        with pytest.raises(AudioFileError, match="cut short"):
            read(tmp_path, data.getvalue()[:-1000])


def test_a_header_that_states_more_than_memory_holds(tmp_path: Path) -> None:
    data = io.BytesIO()
    soundfile.write(data, tone(SAMPLE_RATE_HZ), SAMPLE_RATE_HZ, format="FLAC")
    flac = bytearray(data.getvalue())
    flac[21:26] = bytes([flac[21] | 0x0F, 0xFF, 0xFF, 0xFF, 0xFF])  # STREAMINFO's total samples, 36 bits (RFC 9639)
    with pytest.raises(AudioFileError, match="states 68719476735 samples"):
        read(tmp_path, bytes(flac))


def test_a_pipe_is_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=path.write_bytes, args=(GOOD,))
    writer.start()
    np.testing.assert_allclose(read_wav(path), tone(SAMPLE_RATE_HZ), atol=1e-4)
    writer.join(10)


def test_other_chunks_are_passed_over_even_of_odd_length(tmp_path: Path) -> None:
    more = b"LIST" + struct.pack("<I", 3) + b"abc\0"
    wanted = tone(SAMPLE_RATE_HZ)
    np.testing.assert_allclose(read(tmp_path, riff(KINDS["16 bit"][2](wanted), before=more)), wanted, atol=1e-4)


@pytest.mark.parametrize("stated", [0x7FFFFFFF, 0xFFFFFFFF, 0x7FFFF000])
def test_a_length_that_a_pipe_could_not_know(stated: int, tmp_path: Path) -> None:
    wanted = tone(SAMPLE_RATE_HZ)
    assert len(read(tmp_path, riff(KINDS["16 bit"][2](wanted), stated=stated))) == len(wanted)


def test_numbers_that_are_none_become_silence_and_giants_are_clipped(tmp_path: Path) -> None:
    data = np.array([0.1, np.nan, np.inf, -np.inf, 1e30, 0.2], "<f4").tobytes()
    got = read(tmp_path, riff(data, FLOAT, 32))
    np.testing.assert_allclose(got, [0.1, 0.0, 0.0, 0.0, 64.0, 0.2], atol=1e-6)


def test_a_file_without_any_number_is_not_taken_for_silence(tmp_path: Path) -> None:
    data = np.array([np.nan, np.inf, -np.inf] * 100, "<f4").tobytes()
    with pytest.raises(AudioFileError, match=r"none of its samples is a number \(NaN or infinite\); record it again"):
        read(tmp_path, riff(data, FLOAT, 32))


DEBIANS = Path(f"/usr/lib/{platform.machine()}-linux-gnu/libsndfile.so.1")
"""What the Debian package has in place of the wheel's."""
REPOSITORY = Path(__file__).parents[2]
READS = """
import sys
from pathlib import Path
from hvcpd.errors import AudioFileError
from hvcpd.hardware.soundfile import read_wav
try:
    read_wav(Path(sys.argv[1]))
except AudioFileError as error:
    print(error)
"""
GOOD = riff(KINDS["16 bit"][2](tone(SAMPLE_RATE_HZ)))


@pytest.mark.parametrize(
    ("data", "part"),
    [
        (b"", "the file is empty"),
        (b"RIFF", "ormat not recognised; record it again, or convert it"),
        (b"ID3\x04 an MP3 file, by its looks", "not a WAV, FLAC, AIFF or Ogg file; convert it"),
        (b"OggS" + bytes(100), "convert it"),
        (GOOD[:12], "No 'data' chunk marker"),
        (GOOD[:30], "No 'data' chunk marker"),
        (GOOD[:40], "No 'data' chunk marker"),
        (GOOD[:44], "cut short, 8000 of 8000 bytes of its samples are missing"),
        (GOOD[:4044], "cut short, 4000 of 8000 bytes of its samples are missing"),
        (riff(b""), "no samples in it; record it again"),
        (riff(b"\0"), "no samples in it"),
        (riff(bytes(100), code=2), "Error in ADPCM WAV file"),
        (riff(bytes(100), rate_hz=4_000), "has 4000 samples a second"),
        (riff(bytes(100), rate_hz=0), "convert it"),
        (riff(bytes(100), rate_hz=400_000), "has 400000 samples a second"),
        (riff(bytes(100), channels=0), "Channel count is zero"),
        (riff(bytes(1000), channels=65), "has 65 channels"),
        (GOOD[:12] + GOOD[36:], "No 'data' chunk marker"),
    ],
)
def test_broken_files(data: bytes, part: str, tmp_path: Path, refused: Refuse) -> None:
    path = tmp_path / "x.wav"
    path.write_bytes(data)
    with pytest.raises(AudioFileError) as error:
        read_wav(path)
    assert part in str(error.value)
    assert str(path) in refused("hear", path)


@pytest.mark.skipif(not DEBIANS.exists(), reason="not installed: libsndfile1")
def test_a_broken_file_is_told_of_with_debians_library(tmp_path: Path) -> None:
    """That of Debian 12 closes the number of a file that it cannot read, even if told not to."""
    spec = find_spec("_soundfile_data")
    assert spec is not None
    (wheels,) = Path(str(spec.origin)).parent.glob("libsndfile_*")
    first = tmp_path / "_soundfile_data"
    first.mkdir()
    (first / "__init__.py").touch()
    (first / wheels.name).symlink_to(DEBIANS)
    (tmp_path / "x.wav").write_bytes(b"RIFF")
    done = subprocess.run(
        [sys.executable, "-c", READS, tmp_path / "x.wav"],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{REPOSITORY}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "ormat not recognised; record it again" in done.stdout, done.stderr


def test_files_that_are_not_there(tmp_path: Path, refused: Refuse) -> None:
    assert "there is no such file; check the name" in refused("hear", tmp_path / "none.wav")
    assert "this is a directory" in refused("hear", tmp_path)
    assert "this is not a file name" in refused("hear", "a\0b.wav")


def test_a_device_that_never_ends_is_not_read(refused: Refuse) -> None:
    assert "a device, which may never end" in refused("hear", "/dev/zero")


@given(st.binary(max_size=120), st.integers(0, 60))
def test_any_bytes_give_sound_or_an_audio_file_error(more: bytes, kept: int) -> None:
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "x.wav"
        path.write_bytes(GOOD[:kept] + more)
        try:
            samples = read_wav(path)
        except AudioFileError:
            return
        assert np.isfinite(samples).all()


@given(hnp.arrays(np.float32, st.integers(1, 200), elements=st.floats(-2, 2, width=32)))
def test_what_is_written_is_read_back(samples: Samples) -> None:
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "x.wav"
        write_wav(path, samples)
        np.testing.assert_allclose(read_wav(path), np.clip(samples, -1.0, 1.0), atol=2**-15)
        with wave.open(str(path)) as other:  # Python's own reader agrees
            assert (other.getframerate(), other.getnchannels(), other.getsampwidth()) == (16_000, 1, 2)
            assert other.getnframes() == len(samples)


@pytest.mark.slow
def test_zeros_before_a_sentence_change_nothing_in_any_format(tmp_path: Path, ran: Ran) -> None:
    """The same sentence as 48 kHz stereo 24-bit and as 16 kHz mono gives the same words."""
    assert main(["say", "Hi, I am Rob, task one complete", "-o", str(tmp_path / "a.wav")]) == 0
    samples = read_wav(tmp_path / "a.wav")
    padded = np.concatenate([np.zeros(8000), samples, np.zeros(8000)])
    padded += np.random.default_rng(2).standard_normal(len(padded)) * 1e-4
    from hvcpd.hardware.audio_resample import resample

    high = resample(padded.astype(np.float32), 16_000, 48_000).astype(np.float64)
    stereo = np.repeat(np.clip(high, -1, 1), 2)
    (tmp_path / "b.wav").write_bytes(riff(_24_bit(stereo), PCM, 24, 48_000, 2, extensible=True))
    assert "I am Rob, task one complete" in ran("hear", tmp_path / "b.wav")
