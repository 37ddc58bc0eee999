"""A word in a natural voice: said by the acoustic network inside a carrier phrase, cut out, and given a speaker's
pitch and tract.

Words are recorded one by one, so that all who know the speaker know each sample; the carrier gives a word the rate, the
melody and the soft edges of running speech.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.acoustic_net import Array, shared_net
from hvcpd.synthesis.allophones import is_flapped
from hvcpd.synthesis.phones import PHONES, Kind, is_vowel, stress_of
from hvcpd.synthesis.placement import LEAD_S
from hvcpd.synthesis.vocoder import HOP, VOICED_HZ, Colour, sound_of
from hvcpd.synthesis.voices import Voice

ALPHABET = {
    " ": 16, ".": 4, "ˈ": 156, "ˌ": 157,
    "AA": 69, "AE": 72, "AO": 76, "AW": 39, "AY": 25, "EH": 86, "EY": 24, "IH": 102, "IY": 51, "OW": 31, "OY": 41,
    "UH": 135, "UW": 63, "AX": 83, "AH": 138, "ER": 87, "T*": 36,
    "B": 44, "CH": 133, "D": 46, "DH": 81, "F": 48, "G": 92, "HH": 50, "JH": 82, "K": 53, "L": 54, "M": 55, "N": 56,
    "NG": 112, "P": 58, "R": 123, "S": 61, "SH": 131, "T": 62, "TH": 119, "V": 64, "W": 65, "Y": 52, "Z": 68, "ZH": 147,
}  # fmt: skip
"""Indices of the network's alphabet (misaki's, an IPA with one sign for each diphthong) by ARPAbet names; T* is a
flap."""

EDGE = 0
"""Index that begins and ends each text."""

TALKER_SCALE = 1.17
"""The recorded talker's formants as multiples of a 17.5 cm tract's."""

FALL, RISE = -8.0 / 12.0, 6.0 / 12.0
"""How far a word's pitch may go from its middle, octaves. At the end of a phrase the talker's pitch breaks down to 60
Hz, which a low voice would have far too low."""


def indices(phones: Sequence[str]) -> list[int]:
    """The network's indices for ARPAbet with stress digits; a vowel without digit has no stress."""
    out: list[int] = []
    for number, phone in enumerate(phones):
        base = phone.rstrip("012")
        if base not in ALPHABET:
            raise KeyError(phone)
        if is_vowel(phone) and stress_of(phone):
            out.append(ALPHABET["ˈ" if stress_of(phone) == 1 else "ˌ"])
        reduced = base in ("AH", "ER") and not stress_of(phone)
        if base == "ER":
            out += [ALPHABET["AX" if reduced else "ER"], ALPHABET["R"]]
        elif base == "AH" and reduced:
            out.append(ALPHABET["AX"])
        elif base == "T" and is_flapped(phones, number):
            out.append(ALPHABET["T*"])
        else:
            out.append(ALPHABET[base])
    return out


UNACCENTED = frozenset(
    "a am an and are as at be been but by can do for from had has have he her his i i'm if in is it its "
    "me my of on or our she so than that the their them then there they this to us was we were will with "
    "would you your".split()
)
"""Words that have no accent of their own inside a phrase, as people say them."""


def unaccented(word: str, phones: tuple[str, ...]) -> tuple[str, ...]:
    """The pronunciation of a word inside a phrase: without stress if it is one of `UNACCENTED`."""
    if word.lower() not in UNACCENTED:
        return phones
    return tuple(phone.replace("1", "0") for phone in phones)


def _text(*parts: str) -> list[int]:
    return [ALPHABET[part] for part in parts]


BEFORE = _text("DH", "AX", " ")
AFTER = _text(" ", "HH", "ˈ", "IH", "R", ".")
"""The carriers: "the … here." and "the … .". An H has the tongue where its neighbours have it, and a T before it is no
flap."""
STOP = _text(".")


MARGIN = 4
"""Frames that are rendered on either side of a word and cut off again, so that its ends are as in running speech."""

TAIL_S = 0.08
"""Time for the last sound before a pause: a stop's release and the fall of a vowel."""

STARTS_EARLY = 6
"""Frames by which a word's first sound (of a stop: its closure) begins before the network's durations say so: seen in
the spectra of "task", "bot", "complete", "five" and "rob"."""

OBSTRUENT_ENDS_EARLY = 1
ENDS_EARLY = {Kind.VOWEL: 4, Kind.GLIDE: 4, Kind.NASAL: 3}
"""Frames by which a word's last sound ends before the durations say so; what follows is the breath of the carrier's
H."""

KEPT = 256
"""Words kept as the network made them, 40 kB each, for other voices and pitches of the same words: what the default
phrasebook has, and some more."""


@dataclass(frozen=True)
class Recording:
    """A word as the network made it: `hidden`, shape (frames, 256), and `f0_hz`, shape (frames,), of which the word
    itself has the frames from `first` up to `end`; `middle_hz` is the median of its pitch."""

    hidden: Array
    f0_hz: Array
    first: int
    end: int
    middle_hz: float


@lru_cache(maxsize=KEPT)
def recorded(phones: tuple[str, ...], final: bool, rate: float) -> Recording:
    """Return a word cut out of its carrier. KeyError for an unknown phone."""
    word = indices(phones)
    net = shared_net()
    here = slice(1 + len(BEFORE), 1 + len(BEFORE) + len(word))
    acoustics = net.acoustics([EDGE, *BEFORE, *word, *(STOP if final else AFTER), EDGE], rate, here)
    ends = np.cumsum(acoustics.frames)
    last = PHONES[phones[-1].rstrip("012")].kind
    first = int(ends[len(BEFORE)]) - STARTS_EARLY
    end = int(ends[len(BEFORE) + len(word)]) - ENDS_EARLY.get(last, OBSTRUENT_ENDS_EARLY)
    begin = max(0, first - MARGIN)
    reach = slice(begin, end + MARGIN + round((TAIL_S if final else LEAD_S) * SAMPLE_RATE_HZ / HOP))
    voiced = acoustics.f0_hz[first:end][acoustics.f0_hz[first:end] > VOICED_HZ]
    middle_hz = float(np.median(voiced)) if len(voiced) else VOICED_HZ
    return Recording(
        acoustics.hidden[reach].copy(), acoustics.f0_hz[reach].copy(), first - begin, end - begin, middle_hz
    )


def word_sound(phones: Sequence[str], voice: Voice, final: bool, pitch: float) -> Samples:
    """Return a word as sound, shape (n,), from `LEAD_S` before its first phone to `LEAD_S` (before a pause: `TAIL_S`)
    after its last one; `pitch` multiplies the voice's pitch. KeyError for an unknown phone."""
    word = recorded(tuple(phones), final, voice.rate)
    seed = zlib.crc32(" ".join(phones).encode())
    sound = sound_of(shared_net(), word.hidden, _pitch(word, voice, pitch), colour_of(voice), seed)
    begin = max(0, word.first * HOP - round(LEAD_S * SAMPLE_RATE_HZ))
    return sound[begin : word.end * HOP + round((TAIL_S if final else LEAD_S) * SAMPLE_RATE_HZ)]


def _pitch(word: Recording, voice: Voice, pitch: float) -> Array:
    """The talker's pitch as that voice has it: its middle is the voice's, its movements are scaled by its range."""
    octaves = np.clip(np.log2(np.maximum(word.f0_hz, VOICED_HZ) / word.middle_hz), FALL, RISE) * voice.pitch_range
    return np.where(word.f0_hz > VOICED_HZ, voice.f0_hz * pitch * np.exp2(octaves), 0.0)


def colour_of(voice: Voice) -> Colour:
    """The spectrum of that voice beside the recorded talker's."""
    return Colour(
        stretch=voice.formant_scale / TALKER_SCALE,
        breath_db=0.4 * (voice.breathiness_db + 36.0),
        tilt_db=2.0 * float(np.log2(voice.tilt_hz / 3500.0)),
    )
