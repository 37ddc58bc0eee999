"""WAV files of any common kind in, 16 kHz mono out.

Format: Microsoft/IBM, "Multimedia Programming Interface and Data Specifications 1.0" (1991) and "Multiple Channel
Audio Data and WAVE Files" (2007) for WAVE_FORMAT_EXTENSIBLE.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hvcpd.errors import AudioFileError, unwritable
from hvcpd.hardware.audio_resample import resample
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

MIN_RATE_HZ = 8_000
MAX_RATE_HZ = 192_000
"""Rates that are read: telephone sound to studio converters."""

MAX_CHANNELS = 64
"""Channels that are averaged; more than any recorder of a robot has, and a bound on a broken header."""

MAX_FILE_BYTES = 2_000_000_000
"""Larger files are refused: their header cannot hold their length, and a robot cannot hold their samples."""

_PCM, _FLOAT, _EXTENSIBLE = 0x0001, 0x0003, 0xFFFE
_SUBFORMAT_TAIL = bytes.fromhex("000000001000800000aa00389b71")
"""The last 14 bytes of the GUIDs KSDATAFORMAT_SUBTYPE_PCM and _IEEE_FLOAT; the first two are the format's number."""

_UNKNOWN_LENGTH = 0x7FFF0000
"""Data lengths from here on are written by programs that stream to a pipe and cannot go back (sox, espeak-ng: about
2^31; others: 2^32 - 1); the data then ends with the file, which MAX_FILE_BYTES keeps smaller."""

MAX_LEVEL = 64.0
"""Samples of float files beyond 36 dB over full scale are clipped here, so that filters cannot overflow."""


@dataclass(frozen=True)
class _Format:
    code: int
    channels: int
    rate_hz: int
    block_bytes: int
    bits: int


def read_wav(path: Path) -> Samples:
    """The sound of a WAV file at 16 kHz, mono: shape (n,), float32, 1.0 = full scale.

    Reads 8, 16, 24 and 32 bit PCM and 32 and 64 bit float at 8 to 192 kHz; several channels are averaged; NaN and
    infinite samples become 0. Raises AudioFileError, naming the file and the remedy, for anything else: a file that
    is missing, no WAV, empty or cut short.
    """
    data = _read_bytes(path)
    if len(data) == 0:
        raise AudioFileError(f"{path}: the file is empty; record it again")
    if len(data) < 12 or data[:4] != b"RIFF" or data[8:12] != b"WAVE":
        raise AudioFileError(f"{path}: not a WAV file; convert it, for example with `sox {path.name} new.wav`")
    format_: _Format | None = None
    for name, begin, length in _chunks(data):
        if name == b"fmt ":
            format_ = _read_format(path, data[begin : begin + length])
        elif name == b"data":
            if format_ is None:
                raise AudioFileError(f"{path}: broken, its samples come before their format; record it again")
            return _read_samples(path, format_, memoryview(data)[begin:], length)
    raise AudioFileError(f"{path}: broken or cut short, no samples in it; record or copy it again")


def write_wav(path: Path, samples: Samples) -> None:
    """Write sound, shape (n,), 1.0 = full scale, as 16 kHz mono 16-bit WAV; what is over full scale is clipped.

    Raises AudioFileError if the file cannot be written.
    """
    scaled = np.rint(np.nan_to_num(samples.astype(np.float64)) * 2.0**15)
    whole = np.clip(scaled, -(2**15), 2**15 - 1).astype("<i2").tobytes()
    header = struct.pack(
        "<4sI4s4sIHHIIHH4sI",
        *(b"RIFF", 36 + len(whole), b"WAVE", b"fmt ", 16),
        *(_PCM, 1, SAMPLE_RATE_HZ, 2 * SAMPLE_RATE_HZ, 2, 16),
        *(b"data", len(whole)),
    )
    try:
        path.write_bytes(header + whole)
    except BrokenPipeError:
        raise  # the reader of a pipe has gone
    except (OSError, ValueError) as error:
        raise AudioFileError(unwritable(path, error)) from error


def _read_bytes(path: Path) -> bytes:
    try:
        if path.is_char_device():
            raise AudioFileError(f"{path}: a device and no WAV file, which may never end; name a file, or - for a pipe")
        if path.stat().st_size > MAX_FILE_BYTES:
            raise AudioFileError(f"{path}: larger than {MAX_FILE_BYTES} bytes; cut it into shorter files")
        return path.read_bytes()
    except FileNotFoundError as error:
        raise AudioFileError(f"{path}: there is no such file; check the name") from error
    except IsADirectoryError as error:
        raise AudioFileError(f"{path}: this is a directory; name a WAV file in it") from error
    except PermissionError as error:
        raise AudioFileError(f"{path}: no permission to read it; run `chmod a+r` on it") from error
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise AudioFileError(f"{path}: cannot be read ({error}); check the name and the disk") from error


def _chunks(data: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Name, first byte and stated length of each RIFF chunk; chunks are padded to even lengths."""
    position = 12
    while position + 8 <= len(data):
        name, length = struct.unpack_from("<4sI", data, position)
        yield name, position + 8, length
        position += 8 + length + length % 2


def _read_format(path: Path, chunk: bytes) -> _Format:
    if len(chunk) < 16:
        raise AudioFileError(f"{path}: broken, its format is cut short; record or copy it again")
    code, channels, rate_hz, _, block_bytes, bits = struct.unpack_from("<HHIIHH", chunk)
    if code == _EXTENSIBLE:
        if len(chunk) < 40 or chunk[26:40] != _SUBFORMAT_TAIL:
            raise AudioFileError(f"{path}: holds a kind of sound unknown here; convert it to 16-bit PCM with sox")
        (code,) = struct.unpack_from("<H", chunk, 24)
    if (code, bits) not in {(_PCM, 8), (_PCM, 16), (_PCM, 24), (_PCM, 32), (_FLOAT, 32), (_FLOAT, 64)}:
        raise AudioFileError(f"{path}: holds {bits}-bit sound of format {code:#x}; convert it to 16-bit PCM with sox")
    if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
        raise AudioFileError(f"{path}: has {rate_hz} samples a second; convert it to {SAMPLE_RATE_HZ} with sox")
    if not 1 <= channels <= MAX_CHANNELS or block_bytes != channels * bits // 8:
        raise AudioFileError(f"{path}: broken, {channels} channels in {block_bytes} bytes; record or copy it again")
    return _Format(code, channels, rate_hz, block_bytes, bits)


def _read_samples(path: Path, format_: _Format, rest: memoryview, length: int) -> Samples:
    """The samples of a data chunk whose header states `length` bytes; `rest` is the file from its first byte on."""
    stated = len(rest) if length >= _UNKNOWN_LENGTH else length
    there = min(stated, len(rest)) // format_.block_bytes
    if stated > len(rest):
        missing, stated_s = (stated - len(rest)) / format_.block_bytes, stated / format_.block_bytes / format_.rate_hz
        raise AudioFileError(
            f"{path}: cut short, {missing:.0f} samples of {stated_s:.2f} s are missing; copy or record it again"
        )
    if there == 0:
        raise AudioFileError(f"{path}: no samples in it; record it again")
    frames = _decode(rest[: there * format_.block_bytes], format_).reshape(there, format_.channels)
    mono = np.nan_to_num(frames, nan=0.0, posinf=0.0, neginf=0.0).mean(axis=1, dtype=np.float64)
    return resample(np.clip(mono, -MAX_LEVEL, MAX_LEVEL).astype(np.float32), format_.rate_hz, SAMPLE_RATE_HZ)


def _decode(data: memoryview, format_: _Format) -> NDArray[np.float64] | NDArray[np.float32]:
    """All samples, channels interleaved, 1.0 = full scale."""
    match format_.code, format_.bits:
        case 3, bits:
            return np.frombuffer(data, f"<f{bits // 8}")
        case _, 8:
            return (np.frombuffer(data, np.uint8).astype(np.float64) - 128.0) / 128.0
        case _, 24:
            whole = np.zeros((len(data) // 3, 4), np.uint8)
            whole[:, 1:] = np.frombuffer(data, np.uint8).reshape(-1, 3)
            return whole.view("<i4")[:, 0] / 2.0**31
        case _, bits:
            return np.frombuffer(data, f"<i{bits // 8}") / 2.0 ** (bits - 1)
