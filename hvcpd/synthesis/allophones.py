"""How a phone is made beside its neighbours: the variants that English speakers use without noticing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hvcpd.synthesis.klatt import Band
from hvcpd.synthesis.phones import OFF_DB, PHONES, Kind, Phone, is_vowel, stress_of


def allophone(phones: Sequence[str], number: int) -> Phone:
    """The phone at `number` as its neighbours in the word make it: reduced, flapped, unaspirated, fronted."""
    name = phones[number]
    base = name.rstrip("012")
    if name == "AH0":
        return PHONES["AX"]
    phone = PHONES[base]
    before = phones[number - 1].rstrip("012") if number else ""
    after = phones[number + 1] if number + 1 < len(phones) else ""
    follower = PHONES[after.rstrip("012")] if after else None
    if base == "AO" and after == "R":
        return AO_BEFORE_R
    if base in ("T", "D") and is_flapped(phones, number):
        return FLAP
    if phone.kind is Kind.STOP:
        if follower is None:
            phone = _final_stop(phone)
        elif before == "S" and not phone.voiced:
            phone = replace(phone, aspiration_s=0.012)
        elif follower.kind is Kind.VOWEL and not stress_of(after):
            phone = replace(phone, aspiration_s=0.6 * phone.aspiration_s)
        elif not phone.voiced and follower.kind in (Kind.VOWEL, Kind.GLIDE):
            phone = _strong_stop(phone, base)
        elif follower.kind in (Kind.STOP, Kind.FRICATIVE, Kind.NASAL):
            phone = replace(phone, aspiration_s=0.0, noise_db=phone.noise_db - 4.0)
    if base in ("K", "G", "NG"):
        phone = _velar(phone, _beside(phones, number))
    if base == "HH" and follower is not None:
        phone = replace(phone, target_hz=follower.target_hz, follow=follower.follow)
    return phone


AO_BEFORE_R = replace(PHONES["AO"], target_hz=(480.0, 830.0, 2300.0), end_hz=(470.0, 900.0, 2100.0))
"""The vowel of "four" on its way to R, closer and rounder than that of "call" (Wells, *Accents of English*, 1982,
FORCE). With the other one "four" was heard as "far"."""

STRONG_BURST_DB, STRONG_BREATH_DB, STRONG_BREATH_S = 12.0, 10.0, 0.015
"""How much louder burst and breath are, and how much longer the breath is, where P, T or K begins a stressed syllable.
Without it PocketSphinx took most of them for F in noise: "task" for "fast"."""
STRONG_T = (Band(2700, 700, -18), Band(3500, 800, -10), Band(5000, 1500, 0), Band(6800, 1800, 0))
"""T's burst there, brighter than a final one: as loud, that was taken for CH."""


def _strong_stop(phone: Phone, base: str) -> Phone:
    """A voiceless stop that begins a stressed syllable."""
    return replace(
        phone,
        noise_db=phone.noise_db + STRONG_BURST_DB,
        aspiration_db=phone.aspiration_db + STRONG_BREATH_DB,
        aspiration_s=phone.aspiration_s + STRONG_BREATH_S,
        bands=STRONG_T if base == "T" else phone.bands,
    )


FINAL_VOICE_BAR_DB = 7.0
"""Level of the voice through a final B, D or G above that through one that begins a syllable, which English hardly
voices at all (Lisker and Abramson 1964); without it "Rob" was taken for "bot" in noise."""


def _final_stop(phone: Phone) -> Phone:
    """A stop at the word's end: released, with a breath if it has no voice, with a clear voice bar if it has one."""
    louder = FINAL_VOICE_BAR_DB if phone.voiced else 0.0
    breath_s = 0.0 if phone.voiced else 0.05
    return replace(
        phone, aspiration_s=breath_s, noise_db=phone.noise_db + 3.0, voicing_db=min(0.0, phone.voicing_db + louder)
    )


FLAP = replace(PHONES["D"], inherent_s=0.025, least_s=0.02, voicing_db=-8.0, noise_db=OFF_DB, transition_s=0.03)
"""American T and D between vowels, the second one unstressed ("water"): a tap of the tongue, 20 to 30 ms (Zue and
Laferriere, JASA 66, 1979)."""


def is_flapped(phones: Sequence[str], number: int) -> bool:
    """Between a vowel (or R) and an unstressed vowel."""
    if not 0 < number < len(phones) - 1:
        return False
    before, after = phones[number - 1], phones[number + 1]
    return (is_vowel(before) or before == "R") and is_vowel(after) and stress_of(after) == 0


def _beside(phones: Sequence[str], number: int) -> str:
    """The sound that a velar leans to: what it opens into, for the nose and at the word's end what it closes."""
    follows = number + 1 < len(phones) and phones[number] != "NG"
    return phones[number + 1] if follows else phones[number - 1] if number else "AX"


def _velar(phone: Phone, neighbour: str) -> Phone:
    """Velars close farther forward beside front vowels; the burst is the front cavity's resonance."""
    vowel = PHONES[neighbour.rstrip("012")]
    f2, f3 = vowel.target_hz[1], vowel.target_hz[2]
    locus = min(2300.0, max(1150.0, 1.2 * f2 + 50.0))
    burst = locus if f2 < 1500.0 else 0.5 * (locus + f3)
    bands = (Band(burst, 300, 0), *phone.bands[1:]) if phone.bands else ()
    return replace(phone, target_hz=(phone.target_hz[0], locus, max(locus + 250.0, 0.9 * f3)), bands=bands)
