"""What the glottis does in a word: level of the voice, breath, pitch, brightness, and how much of it is noise.

Before a pause the voice sinks and turns to breath, as people's voices do.
"""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.synthesis.klatt import Track
from hvcpd.synthesis.phones import OFF_DB, Kind
from hvcpd.synthesis.placement import TAIL_S, Breakpoints, Placed, with_neighbours
from hvcpd.synthesis.voices import Voice

FALL_S, FALL_DB = 0.06, 6.0
"""Time and depth of the fall of the voice's level before the end of a phrase: it gives way, and does not stop dead."""

H_VOICE_S, H_VOICE_DB = 0.04, -12.0
"""How long before the end of an H the voice comes in, and its level: the folds swing before the glottis has closed.
Where it comes in later, PocketSphinx takes more H for F, and robots hear less of what is said slowly."""

VOICED_HZ = {Kind.VOWEL: 2300.0, Kind.GLIDE: 2000.0, Kind.NASAL: 1800.0, Kind.FRICATIVE: 1000.0}
"""Maximum voiced frequency; above it the source is noise. Elsewhere (voice bars) 900 Hz."""

UNSTRESSED_HZ = 300.0
"""How far lower it is in a vowel without stress."""

END_HZ = 1500.0
"""And at the end of a phrase, at most, where the voice gives way to breath."""

VOICE_BAR_TILT_HZ, NASAL_TILT_HZ, FRICATIVE_TILT = 350.0, 1000.0, 0.6
"""Corner of the source's low-pass in closures and nasals; in fricatives the share of the voice's own corner."""

ACCENT = {1: 0.12, 2: 0.05}
"""How far the pitch rises on a stressed vowel, of the voice's pitch."""

FINAL_FALL, MEDIAL_FALL = 0.18, 0.04
"""How far below it a word ends, before a pause and inside a phrase."""


RAMP_S = 0.012
"""Time in which a source is switched on or off."""


def _steps(end_s: float, levels: Sequence[tuple[float, float]], final: bool, fall_db: float = 0.0) -> Track:
    """A track of levels, each from its time on (s, dB), with ramps between; before a pause it falls by `fall_db` and
    dies away."""
    before = levels[0][1]
    points = Breakpoints([0.0], [before])
    for start, level in levels[1:]:
        points.add(start - 0.5 * RAMP_S, before)
        points.add(start + 0.5 * RAMP_S, level)
        before = level
    if final:
        points.add(end_s - FALL_S, before)
        points.add(end_s, before - fall_db)
        points.add(end_s + TAIL_S - 0.015, max(OFF_DB, before - 30.0))
        points.add(end_s + TAIL_S - 0.01, OFF_DB)
    return points.track()


def voicing(placed: Sequence[Placed], final: bool) -> Track:
    """Return the level of the voice, dB relative to a stressed vowel."""
    levels: list[tuple[float, float]] = []
    for before, item, _ in with_neighbours(placed):
        level = {0: -2.5, 1: 0.0, 2: -1.0}[item.stress] if item.phone.kind is Kind.VOWEL else item.phone.voicing_db
        breath_s = before.breath_s if before is not None else 0.0
        if breath_s > 0.0:
            levels.append((item.start_s, OFF_DB))
        levels.append((min(item.start_s + breath_s, item.end_s), level))
        if item.phone.kind is Kind.BREATH:
            levels.append((max(item.end_s - H_VOICE_S, item.start_s), H_VOICE_DB))
    return _steps(placed[-1].end_s, levels, final, FALL_DB)


def aspiration(placed: Sequence[Placed], voice: Voice, final: bool) -> Track:
    """Return the level of the breath, dB relative to a vowel."""
    levels: list[tuple[float, float]] = []
    for before, item, _ in with_neighbours(placed):
        breath_s = before.breath_s if before is not None else 0.0
        if before is not None and breath_s > 0.0:
            levels.append((item.start_s, before.phone.aspiration_db))
        if item.phone.kind is Kind.BREATH:
            level = item.phone.noise_db
        elif item.phone.kind in (Kind.VOWEL, Kind.GLIDE, Kind.NASAL):
            level = voice.breathiness_db
        else:
            level = OFF_DB
        levels.append((min(item.start_s + breath_s, item.end_s), level))
    last = placed[-1]
    if last.breath_s > 0.0:
        levels.append((last.end_s, last.phone.aspiration_db))
    return _steps(last.end_s + last.breath_s, levels, final)


def maximum_voiced(placed: Sequence[Placed], voice: Voice, final: bool) -> Track:
    """Return the maximum voiced frequency, Hz: lower in breathy voices."""
    points = Breakpoints([], [])
    breathy = 2.0 ** (-(voice.breathiness_db + 36.0) / 30.0)
    for item in placed:
        hz = VOICED_HZ.get(item.phone.kind, 900.0)
        hz -= UNSTRESSED_HZ if item.phone.kind is Kind.VOWEL and not item.stress else 0.0
        points.add(item.start_s + 0.01, hz * breathy)
        points.add(item.end_s - 0.01, hz * breathy)
    if final:
        points.values[-1] = min(points.values[-1], END_HZ)
        points.add(placed[-1].end_s + TAIL_S, 0.6 * END_HZ)
    return points.track()


def pitch(placed: Sequence[Placed], voice: Voice, final: bool, declination: float) -> Track:
    """An accent on each stressed vowel above a line that falls; before a pause it falls to the speaker's floor."""
    base = voice.f0_hz * declination
    end_s = placed[-1].end_s
    points = Breakpoints([0.0], [base])
    for item in placed:
        if item.phone.kind is Kind.VOWEL and item.stress:
            peak = 1.0 + voice.pitch_range * ACCENT[item.stress]
            points.add(item.start_s + 0.35 * (item.end_s - item.start_s), base * peak)
            points.add(item.end_s, base * (1.0 - 0.02 * voice.pitch_range))
    points.add(end_s, base * (1.0 - (FINAL_FALL if final else MEDIAL_FALL) * voice.pitch_range))
    return points.track()


def tilt(placed: Sequence[Placed], voice: Voice) -> Track:
    """Return the corner of the source's low-pass, Hz."""
    points = Breakpoints([], [])
    for item in placed:
        if item.phone.kind in (Kind.STOP, Kind.AFFRICATE):
            hz = VOICE_BAR_TILT_HZ
        elif item.phone.kind is Kind.NASAL:
            hz = NASAL_TILT_HZ
        elif item.phone.kind is Kind.FRICATIVE:
            hz = FRICATIVE_TILT * voice.tilt_hz
        else:
            hz = voice.tilt_hz
        points.add(item.start_s + 0.008, hz)
        points.add(item.end_s - 0.008, hz)
    return points.track()
