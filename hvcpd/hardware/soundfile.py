"""Recordings of any common format in, 16 kHz mono out and into WAV files.

libsndfile reads, through python-soundfile, which is loaded with the first recording: a daemon that reads none does
without it. Python's own `wave` writes. The choice is explained in docs/decisions/libraries.md.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import shutil
import stat
import tempfile
import wave
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from hvcpd.config.files import write_whole
from hvcpd.errors import AudioFileError, unreadable, unwritable
from hvcpd.hardware.audio_resample import resample
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

MIN_RATE_HZ = 8_000
MAX_RATE_HZ = 192_000
"""Rates that are read: telephone sound to studio converters."""

MAX_CHANNELS = 64
"""Channels that are averaged; more than any recorder of a robot has, and a bound on a broken header."""

MAX_FILE_BYTES = 2_000_000_000
"""Larger files are refused: their header cannot hold their length, and a robot cannot hold their samples."""

MAX_SAMPLES = MAX_FILE_BYTES // 2
"""Most samples of all channels that are read: as many as a WAV file of MAX_FILE_BYTES can hold; a broken header may
state more."""

LEAST_MONO = 0.01
"""Power of the channels' mean, relative to theirs, below which they cancel; of 64 that are unlike it has 0.016."""

MAX_LEVEL = 64.0
"""Samples of float files beyond 36 dB over full scale are clipped here, so that filters cannot overflow."""

_MAGICS = (b"RIFF", b"RF64", b"FORM", b"fLaC", b"OggS")
"""First bytes of WAV, AIFF, FLAC and Ogg. All else is refused: libsndfile guesses at MP3, and its decoder then
complains on standard error."""

_REPAIRED = re.compile(r"^\s*(?:data|SSND)\s*: (\d+) \(should be (\d+)\)", re.MULTILINE)
"""How libsndfile logs that a WAV or AIFF file states more bytes of samples than it has; it reads what is there."""

_UNKNOWN_LENGTH = 0x7FFF0000
"""Data lengths from here on are written by programs that stream to a pipe and cannot go back (sox, espeak-ng: about
2^31; others: 2^32 - 1); the data then ends with the file, which MAX_FILE_BYTES keeps smaller."""


def read_wav(path: Path, pipes: bool = True) -> Samples:
    """Return the sound of a recording at 16 kHz, mono: shape (n,), float32, 1.0 = full scale.

    Reads WAV, FLAC, AIFF and Ogg at 8 to 192 kHz; several channels are averaged, and where they cancel the loudest
    counts; NaN and infinite samples become 0. A pipe, where `pipes` allows one, is read until its writer ends.
    Raises AudioFileError, naming the file and the remedy, for a file that is missing, of another format, empty or cut
    short.
    """
    try:
        mode = path.stat().st_mode
        if stat.S_ISCHR(mode) or stat.S_ISBLK(mode):
            raise AudioFileError(f"{path}: a device, which may never end; name a file, or - for a pipe")
        if stat.S_ISFIFO(mode) and not pipes:
            raise AudioFileError(f"{path}: a pipe, which has no sound until somebody writes; put a file there")
        with path.open("rb") as file:
            if stat.S_ISREG(mode):
                return _read_file(path, file)
            with tempfile.TemporaryFile() as whole:  # a pipe, in which libsndfile cannot go back
                shutil.copyfileobj(file, whole)
                whole.seek(0)
                return _read_file(path, whole)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise AudioFileError(f"{path}: {unreadable(error)}") from error


def write_wav(path: Path, samples: Samples, mode: int | None = None) -> None:
    """Write sound, shape (n,), 1.0 = full scale, as 16 kHz mono 16-bit WAV; louder samples are clipped.

    A `mode` is the permissions of a private file, as in `write_whole`. Raises AudioFileError if the file cannot be
    written; then it is as it was.
    """
    scaled = np.rint(np.nan_to_num(samples.astype(np.float64)) * 2.0**15)
    data = io.BytesIO()
    with wave.open(data, "wb") as file:
        file.setparams((1, 2, SAMPLE_RATE_HZ, 0, "NONE", ""))
        file.writeframes(np.clip(scaled, -(2**15), 2**15 - 1).astype("<i2").tobytes())
    try:
        write_whole(path, data.getvalue(), mode)
    except BrokenPipeError:
        raise  # the reader of a pipe has gone
    except (OSError, ValueError) as error:
        raise AudioFileError(unwritable(path, error)) from error


def _read_file(path: Path, file: BinaryIO) -> Samples:
    """Return the samples of an open file of known length, as `read_wav` does; messages name it `path`."""
    import soundfile

    magic = file.read(4)
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    if size == 0:
        raise AudioFileError(f"{path}: the file is empty; record it again")
    if size > MAX_FILE_BYTES:
        raise AudioFileError(f"{path}: larger than {MAX_FILE_BYTES} bytes; cut it into shorter files")
    convert = f"with `sox {shlex.quote(str(path))} new.wav`"
    if magic not in _MAGICS:
        raise AudioFileError(f"{path}: not a WAV, FLAC, AIFF or Ogg file; convert it, for example {convert}")
    try:
        # By its number: a Python file would be read by callbacks, which need memory that the service's unit forbids. By
        # a number of its own: Debian 12's libsndfile closes it where it cannot read the file, whatever `closefd` says.
        with soundfile.SoundFile(os.dup(file.fileno())) as sound:
            _check(path, sound.samplerate, sound.channels, sound.frames, sound.extra_info)
            frames = sound.read(sound.frames, dtype="float32", always_2d=True)  # "all" fails where it cannot seek
            rate_hz: int = sound.samplerate
    except soundfile.LibsndfileError as error:
        reason = error.error_string.rstrip(".")
        raise AudioFileError(f"{path}: {reason}; record it again, or convert it {convert}") from error
    if not len(frames):
        raise AudioFileError(f"{path}: cut short, or its samples cannot be read; copy or record it again")
    if not np.isfinite(frames).any():
        raise AudioFileError(f"{path}: none of its samples is a number (NaN or infinite); record it again")
    mono = _mono(np.nan_to_num(frames, nan=0.0, posinf=0.0, neginf=0.0))
    return resample(np.clip(mono, -MAX_LEVEL, MAX_LEVEL).astype(np.float32), rate_hz, SAMPLE_RATE_HZ)


def _mono(frames: Samples) -> NDArray[np.float64]:
    """The mean of all channels, frames of shape (n, channels); the loudest one where they cancel, as those of a
    microphone with one wire the wrong way round do."""
    mono = frames.mean(axis=1, dtype=np.float64)
    powers = np.mean(np.square(frames, dtype=np.float64), axis=0)
    if np.mean(mono**2) >= LEAST_MONO * powers.mean():
        return np.asarray(mono, np.float64)
    return frames[:, int(np.argmax(powers))].astype(np.float64)


def _check(path: Path, rate_hz: int, channels: int, frames: int, log: str) -> None:
    """Raise AudioFileError for what libsndfile reads and we do not."""
    if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
        raise AudioFileError(f"{path}: has {rate_hz} samples a second; convert it to {SAMPLE_RATE_HZ} with sox")
    if channels > MAX_CHANNELS:
        raise AudioFileError(f"{path}: has {channels} channels; convert it to one with sox")
    repaired = _REPAIRED.search(log)
    if repaired:
        stated, found = map(int, repaired.groups())
        if found < stated < _UNKNOWN_LENGTH:
            missing = f"{stated - found} of {stated} bytes of its samples are missing"
            raise AudioFileError(f"{path}: cut short, {missing}; copy or record it again")
    if frames * channels > MAX_SAMPLES:
        raise AudioFileError(f"{path}: states {frames} samples, too many to read; cut it into shorter files")
    if frames <= 0:
        raise AudioFileError(f"{path}: no samples in it; record it again")
