"""A folder of recorded words, one WAV each, named by its word: `water.wav`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hvcpd.errors import AudioFileError
from hvcpd.hardware.soundfile import read_wav
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.recorded import RecordedSpeaker
from hvcpd.synthesis.voices import Voice

SHOWN = 40
"""Missing words that are named; who lacks more has only begun."""


def recorded_voice(
    folder: Path, words: Iterable[str], lexicon: Lexicon, stand_in: Voice | None = None
) -> RecordedSpeaker:
    """The voice of a folder, of which `words` are needed: any WAV that `hvcpctl hear` reads.

    `stand_in` says all others. Raises AudioFileError that names every word without a file, or every file of them that
    cannot be used, at once.
    """
    if not folder.is_dir():
        raise AudioFileError(f"{folder}: there is no such folder; name one that holds a WAV for each word (water.wav)")
    files = {path.stem.lower(): path for path in sorted(folder.iterdir()) if path.suffix.lower() == ".wav"}
    wanted = sorted({word.lower() for word in words})
    missing = [word for word in wanted if word not in files]
    faults = []
    if missing:
        more = f" and {len(missing) - SHOWN} more" if len(missing) > SHOWN else ""
        faults.append(f"{folder}: no recording of {', '.join(missing[:SHOWN])}{more}; record each as WORD.wav")
    recordings = {}
    for word in wanted:
        if word in files:
            try:
                recordings[word] = read_wav(files[word])
            except AudioFileError as error:
                faults.append(str(error))
    speaker = RecordedSpeaker(recordings, lexicon, stand_in)
    faults += [f"{files[word]}: nothing is to be heard in it; record it again" for word in speaker.missing(recordings)]
    if faults:
        raise AudioFileError("\n".join(faults))
    return speaker
