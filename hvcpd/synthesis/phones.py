"""The phones of American and British English as the synthesizer needs them: targets, durations, noise spectra.

Formants and bandwidths of an adult male after Klatt (1980), tables II and III; inherent and least durations after
Klatt ("Synthesis by rule of segmental durations in English sentences", 1979); loci after Klatt (1987). From there they
were moved, phone by phone, to where an independent recogniser's phone models (PocketSphinx's en-us, aligned to words of
our lexicon in two voices, in quiet and at 20 dB SNR) find the phone most likely: more open ends of the diphthongs,
shorter stops, stronger frication, a fuller R. Noise spectra are set for 16 kHz, where Klatt's stop at 5 kHz.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from hvcpd.synthesis.klatt import Band

Triple = tuple[float, float, float]

OFF_DB = -99.0
"""Level of a source that does not sound."""


class Kind(Enum):
    """How a phone is made, which decides how its sources are timed."""

    VOWEL = "vowel"
    GLIDE = "glide"
    NASAL = "nasal"
    FRICATIVE = "fricative"
    STOP = "stop"
    AFFRICATE = "affricate"
    BREATH = "breath"


@dataclass(frozen=True)
class Phone:
    """One phone. Frequencies in Hz for a male voice, durations in s, levels in dB relative to a vowel.

    `target_hz` is where the formants go (the locus of an obstruent), `end_hz` where a diphthong ends, `pull` how far a
    neighbouring vowel draws each formant away from that at the boundary (0 = not at all), `follow` which share of a
    voice's formant scale each formant takes.
    """

    kind: Kind
    target_hz: Triple
    width_hz: Triple
    inherent_s: float
    least_s: float
    end_hz: Triple | None = None
    voiced: bool = True
    pull: Triple = (0.0, 0.4, 0.4)
    transition_s: float = 0.05
    voicing_db: float = 0.0
    noise_db: float = OFF_DB
    bands: tuple[Band, ...] = ()
    aspiration_s: float = 0.0
    aspiration_db: float = -12.0
    follow: Triple = (1.0, 1.0, 1.0)

    def scaled(self, scale: float) -> Phone:
        """The phone as spoken by a tract whose formants lie `scale` times as high."""
        f1, f2, f3 = (1.0 + share * (scale - 1.0) for share in self.follow)
        end = self.end_hz and (self.end_hz[0] * f1, self.end_hz[1] * f2, self.end_hz[2] * f3)
        target = (self.target_hz[0] * f1, self.target_hz[1] * f2, self.target_hz[2] * f3)
        return replace(self, target_hz=target, end_hz=end)


EVENLY: Triple = (1.0, 1.0, 1.0)
ROUNDED: Triple = (0.3, 0.6, 0.8)
"""Shares of the formant scale that rounded back vowels take. Women's tracts are not men's made smaller: of the 17 %
by which their formants lie higher, the open-o has 4 % in its first and 10 % in its second (Peterson and Barney 1952;
Fant, "Non-uniform vowel normalization", STL-QPSR 2-3/1975). Scaled evenly, "four" in high voices became "five"."""


def _vowel(
    start: Triple,
    width: Triple,
    inherent_ms: float,
    least_ms: float,
    end: Triple | None = None,
    follow: Triple = EVENLY,
) -> Phone:
    return Phone(
        Kind.VOWEL, start, width, inherent_ms / 1000, least_ms / 1000, end_hz=end, transition_s=0.06, follow=follow
    )  # fmt: skip


def _glide(target: Triple, width: Triple, inherent_ms: float, least_ms: float, transition_ms: float) -> Phone:
    return Phone(
        Kind.GLIDE, target, width, inherent_ms / 1000, least_ms / 1000,
        pull=(0.4, 0.35, 0.35), transition_s=transition_ms / 1000, voicing_db=-2.5,
    )  # fmt: skip


def _nasal(target: Triple, inherent_ms: float, least_ms: float) -> Phone:
    return Phone(
        Kind.NASAL, target, (60.0, 300.0, 300.0), inherent_ms / 1000, least_ms / 1000,
        pull=(0.5, 0.4, 0.4), transition_s=0.045, voicing_db=-3.0,
    )  # fmt: skip


CLEARER_DB = 4.0
"""Level of the noise of fricatives above the one at which the phone models like it best in quiet. Talkers who mean to
be understood raise it against the vowels (Picheny, Durlach and Braida, JSHR 29, 1986); without it "stop" in high voices
became "bot" at 20 dB. Louder bursts as well would cost our own recognition at -8 dB."""


def _fricative(
    target: Triple, voiced: bool, inherent_ms: float, least_ms: float, noise_db: float, bands: tuple[Band, ...]
) -> Phone:
    return Phone(
        Kind.FRICATIVE, target, (80.0, 120.0, 200.0), inherent_ms / 1000, least_ms / 1000, voiced=voiced,
        pull=(0.3, 0.45, 0.45), transition_s=0.045, voicing_db=-11.0 if voiced else OFF_DB,
        noise_db=noise_db + CLEARER_DB, bands=bands,
    )  # fmt: skip


def _stop(
    target: Triple, voiced: bool, inherent_ms: float, least_ms: float, noise_db: float, bands: tuple[Band, ...],
    pull: Triple, aspiration_ms: float,
) -> Phone:  # fmt: skip
    return Phone(
        Kind.STOP, target, (80.0, 130.0, 220.0), inherent_ms / 1000, least_ms / 1000, voiced=voiced,
        pull=pull, transition_s=0.045, voicing_db=-14.0 if voiced else OFF_DB,
        noise_db=noise_db, bands=bands, aspiration_s=aspiration_ms / 1000,
    )  # fmt: skip


_S = (Band(3800, 700, -6), Band(4800, 900, 0), Band(6200, 1200, 0), Band(7300, 1200, -3))
_SH = (Band(2600, 400, -3), Band(3300, 600, 0), Band(4600, 900, -5), Band(6200, 1500, -12))
_F = (Band(1500, 1500, -14), Band(4000, 2500, -6), Band(7200, 2500, 0))
_TH = (Band(1500, 1200, -18), Band(5200, 2500, -4), Band(7300, 1800, 0))
_P = (Band(700, 700, 0), Band(2000, 2000, -8), Band(5000, 3000, -14))
_T = (Band(2700, 700, -9), Band(3500, 800, -1), Band(4600, 1500, 0), Band(6600, 1800, -5))
_K = (Band(1900, 350, 0), Band(3600, 900, -12), Band(5200, 1500, -20))

PHONES: dict[str, Phone] = {
    "AA": _vowel((750, 1150, 2550), (110, 80, 160), 230, 100),
    "AE": _vowel((690, 1680, 2430), (70, 150, 250), 230, 90, end=(700, 1530, 2470)),
    "AH": _vowel((620, 1220, 2550), (80, 50, 140), 140, 60),
    "AO": _vowel((600, 920, 2520), (90, 100, 80), 190, 95, end=(640, 1000, 2550), follow=ROUNDED),
    "AW": _vowel((740, 1350, 2550), (80, 70, 140), 250, 100, end=(500, 1000, 2450)),
    "AX": _vowel((520, 1380, 2500), (80, 80, 140), 75, 35),
    "AY": _vowel((730, 1250, 2550), (100, 70, 200), 220, 110, end=(520, 1730, 2510)),
    "EH": _vowel((560, 1720, 2500), (60, 90, 200), 150, 70, end=(610, 1600, 2530)),
    "ER": _vowel((470, 1270, 1560), (100, 60, 110), 180, 80, end=(430, 1310, 1560)),
    "EY": _vowel((500, 1850, 2520), (70, 100, 200), 175, 100, end=(380, 2050, 2600)),
    "IH": _vowel((410, 1850, 2570), (50, 100, 140), 135, 50, end=(450, 1720, 2600)),
    "IY": _vowel((310, 2080, 2960), (50, 150, 300), 160, 60, end=(285, 2200, 3000)),
    "OW": _vowel((540, 1100, 2350), (80, 70, 70), 220, 90, end=(430, 970, 2300)),
    "OY": _vowel((550, 900, 2400), (80, 50, 130), 270, 140, end=(360, 1900, 2480)),
    "UH": _vowel((450, 1100, 2350), (80, 100, 80), 150, 60, end=(490, 1180, 2390)),
    "UW": _vowel((350, 1200, 2200), (65, 110, 140), 200, 70, end=(315, 880, 2200)),
    "W": _glide((290, 610, 2150), (50, 80, 60), 75, 50, 75),
    "Y": _glide((260, 2150, 3020), (40, 200, 400), 75, 40, 70),
    "R": _glide((390, 1170, 1530), (60, 90, 100), 75, 40, 65),
    "L": _glide((380, 980, 2700), (50, 100, 250), 80, 40, 45),
    "M": _nasal((450, 1080, 2150), 85, 65),
    "N": _nasal((480, 1600, 2600), 80, 60),
    "NG": _nasal((480, 2050, 2550), 100, 65),
    "HH": Phone(
        Kind.BREATH, (500, 1500, 2500), (300, 200, 250), 0.09, 0.06, voiced=False, voicing_db=OFF_DB, noise_db=4.0
    ),
    "F": _fricative((320, 1050, 2150), False, 105, 80, -11.0, _F),
    "V": _fricative((240, 1050, 2150), True, 65, 45, -22.0, _F),
    "TH": _fricative((320, 1320, 2540), False, 95, 70, -13.0, _TH),
    "DH": _fricative((270, 1320, 2540), True, 50, 35, -26.0, _TH),
    "S": _fricative((320, 1600, 2560), False, 110, 70, -2.0, _S),
    "Z": _fricative((240, 1600, 2560), True, 80, 50, -8.0, _S),
    "SH": _fricative((300, 1850, 2650), False, 110, 80, -1.0, _SH),
    "ZH": _fricative((260, 1850, 2650), True, 75, 50, -13.0, _SH),
    "P": _stop((250, 900, 2150), False, 75, 50, -16.0, _P, (0.1, 0.5, 0.4), 35),
    "B": _stop((200, 900, 2150), True, 68, 44, -8.0, _P, (0.1, 0.5, 0.4), 0),
    "T": _stop((250, 1750, 2650), False, 50, 38, -10.0, _T, (0.1, 0.4, 0.3), 45),
    "D": _stop((200, 1750, 2650), True, 65, 45, -11.0, _T, (0.1, 0.4, 0.3), 0),
    "K": _stop((250, 1900, 2350), False, 68, 48, -5.0, _K, (0.1, 0.6, 0.35), 50),
    "G": _stop((200, 1900, 2350), True, 70, 50, 0.0, _K, (0.1, 0.6, 0.35), 14),
    "CH": Phone(
        Kind.AFFRICATE, (280, 1850, 2650), (80, 130, 250), 0.055, 0.04, voiced=False, pull=(0.1, 0.4, 0.3),
        voicing_db=OFF_DB, noise_db=-3.0, bands=_SH, aspiration_s=0.075,
    ),
    "JH": Phone(
        Kind.AFFRICATE, (220, 1850, 2650), (80, 130, 250), 0.05, 0.04, pull=(0.1, 0.4, 0.3),
        voicing_db=-14.0, noise_db=-3.0, bands=_SH, aspiration_s=0.05,
    ),
}  # fmt: skip
"""Every phone by its ARPAbet name, and AX, the reduced vowel that CMUdict writes AH0."""

ARPABET = frozenset(PHONES) - {"AX"}
"""The 39 phones that a lexicon may use."""

UNFLAPPED = {"T": "TT", "D": "DD"}
"""Names of a T and a D that British English keeps where American English has a tap."""

BRITISH = {
    "OH": _vowel((600, 1060, 2500), (90, 100, 80), 190, 80, follow=ROUNDED),
    "AO:": _vowel((475, 830, 2600), (90, 90, 80), 210, 100, follow=ROUNDED),
    "AX:": _vowel((478, 1436, 2488), (80, 80, 140), 190, 90),
    "EH:": _vowel((560, 1680, 2500), (60, 90, 200), 210, 100),
    "AXW": _vowel((500, 1380, 2450), (80, 80, 100), 220, 90, end=(410, 1060, 2350)),
    "IA": _vowel((390, 1950, 2570), (50, 100, 140), 220, 100, end=(500, 1500, 2500)),
    **{name: PHONES[flapped] for flapped, name in UNFLAPPED.items()},
}
"""The vowels of "lot", "thought", "nurse", "square", "goat" and "near" in Standard Southern British.

AX: is the mean of five men (D. Deterding, "The formants of monophthong vowels in Standard Southern British English
pronunciation", JIPA 27, 1997). OH and AO: are more open than theirs: with 558 Hz and 160 ms the
net for "stop" gave .68 instead of .88 (mean of eight voices), and with 430 Hz "four" came near "two". The ends of the
diphthongs and the durations follow the vowels above.
"""

PHONES |= BRITISH


def is_vowel(phone: str) -> bool:
    """Whether a phone, with or without its stress digit, is a vowel."""
    return PHONES[phone.rstrip("012")].kind is Kind.VOWEL


def stress_of(phone: str) -> int:
    """0, 1 or 2 for a vowel; 0 for a consonant."""
    return int(phone[-1]) if phone[-1].isdigit() else 0
