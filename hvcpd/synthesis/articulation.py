"""From phones to the synthesizer's controls: where the formants go, and which noises sound.

Every phone owns a stretch of time. Formants hold the phone's target and glide to the value that the two phones agree
on at their boundary (locus theory: Delattre, Liberman and Cooper 1955; Klatt 1987): an obstruent draws the vowel to
its locus, a glide half-way, two vowels meet in the middle.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace

from hvcpd.synthesis.klatt import SILENCE_DB, Controls, Frication, Track
from hvcpd.synthesis.phonation import aspiration, maximum_voiced, pitch, tilt, voicing
from hvcpd.synthesis.phones import Kind
from hvcpd.synthesis.placement import BURST_S, LEAD_S, TAIL_S, Breakpoints, Placed, place, with_neighbours
from hvcpd.synthesis.voices import Voice

UPPER_HZ = ((3500.0, 220.0), (4500.0, 300.0), (5500.0, 400.0), (6500.0, 500.0), (7450.0, 600.0))
"""Formants four to eight of a 17.5 cm tube, one a kilohertz, with bandwidths that grow; (Hz, Hz). To let four and five
follow the third, and so the vowel, sounded no more natural to two predictors of opinions (16 sentences)."""

NASAL_HZ = 270.0
"""The nose's lowest pole (Klatt 1980)."""

NASAL_ZERO_HZ = 450.0
"""The zero of a nasal murmur (Klatt 1980)."""

NASAL_BEFORE_S = 0.08
"""Longest time before a nasal's closure at which the velum opens (Cohn 1993)."""

NASAL_AFTER_S = 0.04
"""Longest time after a nasal's release for which the velum stays open (Cohn 1993)."""


def _boundary(left: Placed, right: Placed, formant: int) -> float:
    """The value of a formant where two phones meet, Hz."""
    a, b = (left.phone.end_hz or left.phone.target_hz)[formant], right.phone.target_hz[formant]
    if Kind.BREATH in (left.phone.kind, right.phone.kind):
        return b if left.phone.kind is Kind.BREATH else a
    left_open, right_open = left.phone.kind is Kind.VOWEL, right.phone.kind is Kind.VOWEL
    if left_open and not right_open:
        return b + right.phone.pull[formant] * (a - b)
    if right_open and not left_open:
        return a + left.phone.pull[formant] * (b - a)
    return 0.5 * (a + b)


def _formant_track(placed: Sequence[Placed], formant: int) -> Track:
    points = Breakpoints([], [])
    for before, item, after in with_neighbours(placed):
        first, last = item.phone.target_hz[formant], (item.phone.end_hz or item.phone.target_hz)[formant]
        length = item.end_s - item.start_s
        entry = _boundary(before, item, formant) if before is not None else first
        leave = _boundary(item, after, formant) if after is not None else last
        rise, fall = _transition_s(before, item), _transition_s(after, item)
        points.add(item.start_s, entry)
        if item.phone.kind in (Kind.VOWEL, Kind.GLIDE, Kind.NASAL, Kind.FRICATIVE):
            squeeze = min(1.0, 0.9 * length / max(1e-6, rise + fall))
            onset, offset = item.start_s + rise * squeeze, item.end_s - fall * squeeze
            if item.phone.end_hz is not None and after is None:
                offset = item.end_s - 0.2 * length
            points.add(onset, first)
            points.add(max(onset, offset), last)
        points.add(item.end_s, leave)
    return points.track()


def _transition_s(neighbour: Placed | None, item: Placed) -> float:
    """How long this phone's formants move at the side of that neighbour."""
    if neighbour is None:
        return 0.0
    if item.phone.kind is Kind.VOWEL:
        return neighbour.phone.transition_s
    return min(0.03, item.phone.transition_s)


def _width_track(placed: Sequence[Placed], formant: int) -> Track:
    points = Breakpoints([], [])
    for item in placed:
        edge = min(0.01, 0.3 * (item.end_s - item.start_s))
        width = item.phone.width_hz[formant]
        points.add(item.start_s + edge, width)
        points.add(item.end_s - edge, width)
    return points.track()


def _frications(placed: Sequence[Placed], scale: float) -> tuple[Frication, ...]:
    events = []
    for item in placed:
        phone = item.phone
        if phone.noise_db < SILENCE_DB or not phone.bands:
            continue
        higher = 1.0 + 0.5 * (scale - 1.0)
        bands = tuple(replace(band, centre_hz=min(7600.0, band.centre_hz * higher)) for band in phone.bands)
        if phone.kind is Kind.FRICATIVE:
            a, b = item.start_s - 0.01, item.end_s + 0.01
            times, relative_db = (a, a + 0.03, b - 0.025, b), (-30, 0, 0, -30)
        elif phone.kind is Kind.AFFRICATE:
            a, b = item.release_s, item.end_s + 0.01
            times, relative_db = (a, a + 0.003, b - 0.02, b), (-20, 2, 0, -30)
        else:
            a = item.release_s
            released = 0.4 if item is not placed[-1] else 0.8
            b = a + BURST_S + released * phone.aspiration_s
            times, relative_db = (a, a + 0.001, a + BURST_S, b + 0.01), (-20, 4, 0, -25)
        events.append(Frication(times, tuple(phone.noise_db + each for each in relative_db), bands))
    return tuple(events)


def _nasal_zero(placed: Sequence[Placed], scale: float) -> Track:
    """The nasal zero: at the pole in oral sounds, away from it in nasals, and on its way in a vowel beside one.

    The velum moves slowly: American vowels before a nasal are nasal for their second half, after one for about 40 ms
    (Cohn, "Nasalization in English: phonology or phonetics", Phonology 10, 1993).
    """
    points = Breakpoints([], [])
    open_hz, shut_hz = NASAL_ZERO_HZ * scale, NASAL_HZ * scale
    for before, item, after in with_neighbours(placed):
        if item.phone.kind is Kind.NASAL:
            points.add(item.start_s + 0.004, open_hz)
            points.add(item.end_s - 0.004, open_hz)
            continue
        length = item.end_s - item.start_s
        sonorous = item.phone.kind in (Kind.VOWEL, Kind.GLIDE)
        after_nasal = sonorous and before is not None and before.phone.kind is Kind.NASAL
        before_nasal = sonorous and after is not None and after.phone.kind is Kind.NASAL
        half_hz = shut_hz + 0.5 * (open_hz - shut_hz)
        if after_nasal:
            points.add(item.start_s + 0.004, half_hz)
        points.add(item.start_s + (min(NASAL_AFTER_S, 0.4 * length) if after_nasal else 0.008), shut_hz)
        points.add(item.end_s - (min(NASAL_BEFORE_S, 0.5 * length) if before_nasal else 0.008), shut_hz)
        if before_nasal:
            points.add(item.end_s - 0.004, half_hz)
    return points.track()


def controls_for(phones: Sequence[str], voice: Voice, final: bool, declination: float = 1.0) -> Controls:
    """The synthesizer's controls for one word.

    `phones` is ARPAbet with stress digits, at least one; `final` when a pause follows; `declination` multiplies the
    pitch. KeyError for an unknown phone.
    """
    scale = voice.formant_scale
    placed = [replace(item, phone=item.phone.scaled(scale)) for item in place(phones, voice.rate, final)]
    return Controls(
        duration_s=placed[-1].end_s + placed[-1].breath_s + (TAIL_S if final else LEAD_S),
        f0_hz=pitch(placed, voice, final, declination),
        voicing_db=voicing(placed, final),
        aspiration_db=aspiration(placed, voice, final),
        tilt_hz=tilt(placed, voice),
        formants_hz=tuple(_formant_track(placed, k) for k in range(3)),
        bandwidths_hz=tuple(_width_track(placed, k) for k in range(3)),
        voiced_hz=maximum_voiced(placed, voice, final),
        nasal_zero_hz=_nasal_zero(placed, scale),
        nasal_pole_hz=NASAL_HZ * scale,
        fixed=tuple((hz * scale, width) for hz, width in UPPER_HZ if hz * scale < 7900.0),
        frications=_frications(placed, scale),
        open_quotient=voice.open_quotient,
        noise_seed=zlib.crc32(f"{' '.join(phones)} {voice.name} {final} {declination}".encode()),
    )
