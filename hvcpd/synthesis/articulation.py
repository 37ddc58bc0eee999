"""From phones to the synthesizer's controls: when each sound starts, where the formants go, which source sounds.

Every phone owns a stretch of time. Formants hold the phone's target and glide to the value that the two phones agree
on at their boundary (locus theory: Delattre, Liberman and Cooper 1955; Klatt 1987): an obstruent draws the vowel to
its locus, a glide half-way, two vowels meet in the middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hvcpd.synthesis.allophones import OFF_DB, allophone
from hvcpd.synthesis.durations import durations_s
from hvcpd.synthesis.klatt import Band, Controls, Frication, Track
from hvcpd.synthesis.phones import Kind, Phone, Triple, stress_of
from hvcpd.synthesis.voices import Voice

LEAD_S = 0.02
"""Time for which a word's sources are on before its first phone and, when another word follows, after its last one:
there neighbouring words are cross-faded, as the voice does not stop between words."""

TAIL_S = 0.03
"""Time for the last sound before a pause to ring out."""

BURST_S = 0.012
"""Length of a plosive's burst (Klatt 1980: 5 to 15 ms)."""

UPPER_HZ = ((3500.0, 220.0), (4500.0, 300.0), (5500.0, 400.0), (6500.0, 500.0), (7450.0, 600.0))
"""Formants four to eight of a 17.5 cm tube, one a kilohertz, with bandwidths that grow; (Hz, Hz)."""

NASAL_HZ = 270.0
"""The nose's lowest pole (Klatt 1980)."""

NASAL_ZERO_HZ = 450.0
"""The zero of a nasal murmur (Klatt 1980)."""


ASPIRATION_DB = -12.0
"""Breath after a voiceless stop, relative to a vowel: a little less than in an H."""

FULL_GLIDE = 0.9
"""Share of its inherent duration that a diphthong needs to reach its end."""

NASAL_BEFORE_S = 0.08
"""Longest time before a nasal's closure at which the velum opens (Cohn 1993)."""

NASAL_AFTER_S = 0.04
"""Longest time after a nasal's release for which the velum stays open (Cohn 1993)."""


@dataclass(frozen=True)
class Placed:
    """A phone in time: formants are its own from `start_s` to `end_s`; a stop's closure ends at `release_s`."""

    name: str
    phone: Phone
    stress: int
    start_s: float
    release_s: float
    end_s: float


@dataclass
class _Breakpoints:
    """A track under construction; times only grow."""

    times_s: list[float]
    values: list[float]

    def add(self, time_s: float, value: float) -> None:
        if self.times_s and time_s < self.times_s[-1]:
            time_s = self.times_s[-1]
        self.times_s.append(time_s)
        self.values.append(value)

    def track(self) -> Track:
        return Track(tuple(self.times_s), tuple(self.values))


def place(phones: Sequence[str], rate: float, final: bool) -> list[Placed]:
    """The phones of a word one after another from `LEAD_S` on; `rate` above 1 is faster."""
    placed = []
    now = LEAD_S
    for number, (name, length_s) in enumerate(zip(phones, durations_s(phones, final), strict=True)):
        phone = allophone(phones, number)
        if phone.kind is Kind.STOP:
            release = now + length_s / rate
            end = release + BURST_S
        elif phone.kind is Kind.AFFRICATE:
            release = now + length_s / rate
            end = release + phone.aspiration_s / rate
        else:
            release = end = now + length_s / rate
        if phone.end_hz is not None:
            phone = _undershot(phone, phone.end_hz, length_s / rate)
        placed.append(Placed(name.rstrip("012"), phone, stress_of(name), now, release, end))
        now = end
        if phone.kind is Kind.STOP and number == len(phones) - 1:
            now += phone.aspiration_s
    return _give_aspiration(placed)


def _undershot(phone: Phone, end_hz: Triple, length_s: float) -> Phone:
    """A diphthong as far as it gets in its time: its formants move at one and the same speed, so that a short one ends
    before its target (Gay, "Effect of speaking rate on diphthong formant movements", JASA 44, 1968)."""
    way = min(1.0, length_s / (FULL_GLIDE * phone.inherent_s))
    start = phone.target_hz
    return replace(
        phone,
        end_hz=(
            start[0] + way * (end_hz[0] - start[0]),
            start[1] + way * (end_hz[1] - start[1]),
            start[2] + way * (end_hz[2] - start[2]),
        ),
    )


def _give_aspiration(placed: list[Placed]) -> list[Placed]:
    """Lengthen what follows an aspirated stop by half of the breath that it begins with."""
    shift = 0.0
    out: list[Placed] = []
    for number, item in enumerate(placed):
        after_stop = number > 0 and placed[number - 1].phone.kind is Kind.STOP
        extra = 0.5 * placed[number - 1].phone.aspiration_s if after_stop else 0.0
        out.append(
            replace(
                item,
                start_s=item.start_s + shift,
                release_s=item.release_s + shift + extra,
                end_s=item.end_s + shift + extra,
            )
        )
        shift += extra
    return out


def _boundary(left: Placed, right: Placed, formant: int) -> float:
    """The value of a formant where two phones meet, Hz."""
    ending = left.phone.end_hz or left.phone.target_hz
    a, b = ending[formant], right.phone.target_hz[formant]
    if left.phone.kind is Kind.BREATH or right.phone.kind is Kind.BREATH:
        return b if left.phone.kind is Kind.BREATH else a
    left_open, right_open = left.phone.kind is Kind.VOWEL, right.phone.kind is Kind.VOWEL
    if left_open and not right_open:
        return b + right.phone.pull[formant] * (a - b)
    if right_open and not left_open:
        return a + left.phone.pull[formant] * (b - a)
    return 0.5 * (a + b)


def _formant_track(placed: Sequence[Placed], formant: int) -> Track:
    points = _Breakpoints([], [])
    for number, item in enumerate(placed):
        first = item.phone.target_hz[formant]
        last = (item.phone.end_hz or item.phone.target_hz)[formant]
        length = item.end_s - item.start_s
        entry = _boundary(placed[number - 1], item, formant) if number else first
        leave = _boundary(item, placed[number + 1], formant) if number + 1 < len(placed) else last
        rise = _transition_s(placed[number - 1] if number else None, item)
        fall = _transition_s(placed[number + 1] if number + 1 < len(placed) else None, item)
        points.add(item.start_s, entry)
        if item.phone.kind in (Kind.VOWEL, Kind.GLIDE, Kind.NASAL, Kind.FRICATIVE):
            squeeze = min(1.0, 0.9 * length / max(1e-6, rise + fall))
            onset, offset = item.start_s + rise * squeeze, item.end_s - fall * squeeze
            if item.phone.end_hz is not None and number + 1 == len(placed):
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
    points = _Breakpoints([], [])
    for item in placed:
        edge = min(0.01, 0.3 * (item.end_s - item.start_s))
        points.add(item.start_s + edge, item.phone.width_hz[formant])
        points.add(item.end_s - edge, item.phone.width_hz[formant])
    return points.track()


def _steps(end_s: float, levels: Sequence[tuple[float, float, float]], ramp_s: float, final: bool) -> Track:
    """A track of (start, end, dB) stretches with ramps between them; before a pause it dies away."""
    before = levels[0][2]
    points = _Breakpoints([0.0], [before])
    for start, _end, level in levels[1:]:
        points.add(start - ramp_s / 2, before)
        points.add(start + ramp_s / 2, level)
        before = level
    if final:
        points.add(end_s - 0.02, before)
        points.add(end_s + 0.015, max(OFF_DB, before - 30.0))
        points.add(end_s + 0.02, OFF_DB)
    return points.track()


def _voicing(placed: Sequence[Placed]) -> list[tuple[float, float, float]]:
    stretches: list[tuple[float, float, float]] = []
    for number, item in enumerate(placed):
        level = {0: -2.5, 1: 0.0, 2: -1.0}[item.stress] if item.phone.kind is Kind.VOWEL else item.phone.voicing_db
        start = item.start_s
        if number:
            start += placed[number - 1].phone.aspiration_s if placed[number - 1].phone.kind is Kind.STOP else 0.0
        if start > item.start_s:
            stretches.append((item.start_s, start, OFF_DB))
        stretches.append((min(start, item.end_s), item.end_s, level))
    return stretches


def _aspiration(placed: Sequence[Placed], breath_db: float) -> list[tuple[float, float, float]]:
    stretches: list[tuple[float, float, float]] = []
    for number, item in enumerate(placed):
        before = placed[number - 1].phone if number else None
        start = item.start_s
        if before is not None and before.kind is Kind.STOP and before.aspiration_s > 0.0:
            start = min(item.end_s, start + before.aspiration_s)
            stretches.append((item.start_s, start, ASPIRATION_DB))
        if item.phone.kind is Kind.BREATH:
            level = item.phone.noise_db
        elif item.phone.kind in (Kind.VOWEL, Kind.GLIDE, Kind.NASAL):
            level = breath_db
        else:
            level = OFF_DB
        stretches.append((start, item.end_s, level))
    last = placed[-1]
    if last.phone.kind is Kind.STOP and last.phone.aspiration_s > 0.0:
        stretches.append((last.end_s, last.end_s + last.phone.aspiration_s, ASPIRATION_DB))
    return stretches


def _frications(placed: Sequence[Placed], scale: float) -> tuple[Frication, ...]:
    events = []
    for item in placed:
        phone = item.phone
        if phone.noise_db < -60.0 or not phone.bands:
            continue
        bands = tuple(
            Band(min(7600.0, band.centre_hz * (1.0 + 0.5 * (scale - 1.0))), band.width_hz, band.gain_db)
            for band in phone.bands
        )
        level = phone.noise_db
        if phone.kind is Kind.FRICATIVE:
            a, b = item.start_s - 0.01, item.end_s + 0.01
            times = (a, a + 0.03, b - 0.025, b)
            events.append(Frication(times, (level - 30, level, level, level - 30), bands))
        elif phone.kind is Kind.AFFRICATE:
            a, b = item.release_s, item.end_s + 0.01
            events.append(Frication((a, a + 0.003, b - 0.02, b), (level - 20, level + 2, level, level - 30), bands))
        else:
            a = item.release_s
            released = 0.4 if item is not placed[-1] else 0.8
            b = a + BURST_S + released * phone.aspiration_s
            times = (a, a + 0.001, a + BURST_S, b + 0.01)
            events.append(Frication(times, (level - 20, level + 4, level, level - 25), bands))
    return tuple(events)


def _pitch(placed: Sequence[Placed], voice: Voice, final: bool, declination: float) -> Track:
    """An accent on each stressed vowel above a line that falls; before a pause it falls to the speaker's floor."""
    base = voice.f0_hz * declination
    end_s = placed[-1].end_s
    points = _Breakpoints([0.0], [base])
    for item in placed:
        if item.phone.kind is Kind.VOWEL and item.stress:
            peak = 1.0 + voice.pitch_range * (0.12 if item.stress == 1 else 0.05)
            points.add(item.start_s + 0.35 * (item.end_s - item.start_s), base * peak)
            points.add(item.end_s, base * (1.0 - 0.02 * voice.pitch_range))
    points.add(end_s, base * (1.0 - (0.18 if final else 0.04) * voice.pitch_range))
    return points.track()


def _nasal_zero(placed: Sequence[Placed], scale: float) -> Track:
    """The nasal zero: at the pole in oral sounds, away from it in nasals, and on its way in a vowel beside one.

    The velum moves slowly: American vowels before a nasal are nasal for their second half, after one for about 40 ms
    (Cohn, "Nasalization in English: phonology or phonetics", Phonology 10, 1993).
    """
    points = _Breakpoints([], [])
    open_hz, shut_hz = NASAL_ZERO_HZ * scale, NASAL_HZ * scale
    for number, item in enumerate(placed):
        if item.phone.kind is Kind.NASAL:
            points.add(item.start_s + 0.004, open_hz)
            points.add(item.end_s - 0.004, open_hz)
            continue
        length = item.end_s - item.start_s
        sonorous = item.phone.kind in (Kind.VOWEL, Kind.GLIDE)
        after_nasal = sonorous and number > 0 and placed[number - 1].phone.kind is Kind.NASAL
        before_nasal = sonorous and number + 1 < len(placed) and placed[number + 1].phone.kind is Kind.NASAL
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
    tilt_points = _Breakpoints([], [])
    for item in placed:
        closed = item.phone.kind in (Kind.STOP, Kind.AFFRICATE)
        tilt = (
            350.0
            if closed
            else 1000.0
            if item.phone.kind is Kind.NASAL
            else voice.tilt_hz * (0.6 if item.phone.kind is Kind.FRICATIVE else 1.0)
        )
        for time in (item.start_s + 0.008, item.end_s - 0.008):
            tilt_points.add(time, tilt)
    rest_s = placed[-1].phone.aspiration_s if placed[-1].phone.kind is Kind.STOP else 0.0
    return Controls(
        duration_s=placed[-1].end_s + rest_s + (TAIL_S if final else LEAD_S),
        f0_hz=_pitch(placed, voice, final, declination),
        voicing_db=_steps(placed[-1].end_s, _voicing(placed), 0.012, final),
        aspiration_db=_steps(placed[-1].end_s + rest_s, _aspiration(placed, voice.breathiness_db), 0.012, final),
        tilt_hz=tilt_points.track(),
        formants_hz=tuple(_formant_track(placed, k) for k in range(3)),
        bandwidths_hz=tuple(_width_track(placed, k) for k in range(3)),
        nasal_zero_hz=_nasal_zero(placed, scale),
        nasal_pole_hz=NASAL_HZ * scale,
        fixed=tuple((hz * scale, width) for hz, width in UPPER_HZ if hz * scale < 7900.0),
        frications=_frications(placed, scale),
        open_quotient=voice.open_quotient,
    )
