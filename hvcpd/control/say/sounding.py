"""What commands that speak have in common: the words of a text that somebody typed, and where their sound goes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hvcpd.config.written import unsayable
from hvcpd.errors import DeviceError, PhraseError
from hvcpd.hardware.soundfile import write_wav
from hvcpd.language.words import spoken_phrases
from hvcpd.ports import Samples

MAX_WORDS = 1000
"""Words explained or said at once; more is a mistake, such as a file pasted in."""


def require_few_words(phrases: Sequence[Sequence[str]]) -> None:
    """Raises PhraseError if there are more than `MAX_WORDS`."""
    if sum(map(len, phrases)) > MAX_WORDS:
        raise PhraseError(f"more than {MAX_WORDS} words; give fewer")


def sayable_phrases(text: str) -> tuple[tuple[str, ...], ...]:
    """The words of a text, whether or not the phrasebook has them, in phrases: each comma is a pause.

    Raises PhraseError where there is nothing to say.
    """
    if strange := unsayable(text):
        raise PhraseError(f"{strange!r} in {text!r} cannot be said: write it in words")
    phrases = spoken_phrases(text)
    if not phrases:
        raise PhraseError(f"nothing to say in {text!r}: write letters or digits")
    return phrases


def write_or_play(samples: Samples, file: Path | None, device: str | None, backend: Any | None = None) -> None:
    """Write the sound, shape (n,), float32, as a WAV file, or without a file play it to the end.

    `device` and `backend` are those of `play`. Raises AudioFileError, and DeviceError with the option that needs no
    loudspeaker.
    """
    if file is not None:
        write_wav(file, samples)
        return
    from hvcpd.hardware.audio_play import play  # only where it is played

    try:
        play(samples, device, backend)
    except DeviceError as error:
        raise DeviceError(f"{error}; or write a WAV file with -o FILE.wav") from error
