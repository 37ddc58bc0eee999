"""When each phone of a word sounds: closures, bursts, breath and diphthongs in time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from hvcpd.synthesis.allophones import allophone
from hvcpd.synthesis.durations import durations_s
from hvcpd.synthesis.klatt import Track
from hvcpd.synthesis.phones import Kind, Phone, Triple, stress_of

LEAD_S = 0.02
"""Time for which a word's sources are on before its first phone and, when another word follows, after its last one:
there neighbouring words are cross-faded, as the voice does not stop between words."""

TAIL_S = 0.05
"""Time for the last sound before a pause to ring out."""

BURST_S = 0.012
"""Length of a plosive's burst (Klatt 1980: 5 to 15 ms)."""

LINKED_BREATH_S = 0.02
"""Longest breath of a word's last stop before another word. With 50 ms "task eight" was heard as "cascade": that breath
is how a stop begins a stressed syllable."""

FULL_GLIDE = 0.9
"""Share of its inherent duration that a diphthong needs to reach its end."""


@dataclass(frozen=True)
class Placed:
    """A phone in time: formants are its own from `start_s` to `end_s`; a stop's closure ends at `release_s`."""

    phone: Phone
    stress: int
    start_s: float
    release_s: float
    end_s: float

    @property
    def breath_s(self) -> float:
        """How long a stop breathes after its burst, s; 0 for every other phone."""
        return self.phone.aspiration_s if self.phone.kind is Kind.STOP else 0.0


def with_neighbours(placed: Sequence[Placed]) -> Iterator[tuple[Placed | None, Placed, Placed | None]]:
    """Each phone between the one before it and the one after it, None at the word's ends."""
    return zip([None, *placed[:-1]], placed, [*placed[1:], None], strict=True)


@dataclass
class Breakpoints:
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


WEAK_BREATH = 1.0
"""Share of a stop's breath by which a vowel without stress is lengthened: else little is left of it in "taken"."""


def place(phones: Sequence[str], rate: float, final: bool) -> list[Placed]:
    """The phones of a word one after another from `LEAD_S` on; `rate` above 1 is faster."""
    placed = []
    now = LEAD_S
    for number, (name, length_s) in enumerate(zip(phones, durations_s(phones, final), strict=True)):
        phone = allophone(phones, number)
        if phone.kind is Kind.STOP and number == len(phones) - 1 and not final:
            phone = replace(phone, aspiration_s=min(phone.aspiration_s, LINKED_BREATH_S))
        release = end = now + length_s / rate
        if phone.kind is Kind.STOP:
            end += BURST_S
        elif phone.kind is Kind.AFFRICATE:
            end += phone.aspiration_s / rate
        if phone.end_hz is not None:
            phone = _undershot(phone, phone.end_hz, length_s / rate)
        placed.append(Placed(phone, stress_of(name), now, release, end))
        now = end
    return _give_aspiration(placed)


def _undershot(phone: Phone, end_hz: Triple, length_s: float) -> Phone:
    """A diphthong as far as it gets in its time: its formants move at one and the same speed, so that a short one ends
    before its target (Gay, "Effect of speaking rate on diphthong formant movements", JASA 44, 1968)."""
    way = min(1.0, length_s / (FULL_GLIDE * phone.inherent_s))
    f1, f2, f3 = (start + way * (end - start) for start, end in zip(phone.target_hz, end_hz, strict=True))
    return replace(phone, end_hz=(f1, f2, f3))


def _give_aspiration(placed: list[Placed]) -> list[Placed]:
    """Lengthen what follows an aspirated stop by half of the breath that it begins with."""
    shift = 0.0
    out: list[Placed] = []
    for before, item, _ in with_neighbours(placed):
        weak = item.phone.kind is Kind.VOWEL and not item.stress
        extra = (WEAK_BREATH if weak else 0.5) * before.breath_s if before is not None else 0.0
        release_s, end_s = item.release_s + shift + extra, item.end_s + shift + extra
        out.append(replace(item, start_s=item.start_s + shift, release_s=release_s, end_s=end_s))
        shift += extra
    return out
