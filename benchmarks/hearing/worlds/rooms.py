"""Rooms: measured impulse responses from a folder, and simulated ones, kept on disk once they are computed.

The simulated are boxes by image sources up to the third order and ray tracing beyond (Schröder, "Physically based
real-time auralization", 2011, as pyroomacoustics has it), with scattering, absorption by octave, and a direct sound
that is scaled where a ratio of direct to reverberant is asked for: a robot that faces away, or stands behind something.
A microphone in the next room hears the door: the response to it and that from it, one after the other.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from hil_fakes.reverberation import HEIGHT_M, SOUND_SPEED_M_S, decay_s
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ

Response = NDArray[np.float32]
OCTAVES_HZ = (125, 250, 500, 1000, 2000, 4000, 8000)
LEAD = 32
"""Samples kept before the direct sound: a band-limited pulse begins before its peak."""
DIRECT = 40
"""Samples (2.5 ms) after it that still count as direct, as ISO 3382-1's annexes and the ACE challenge have it."""
DECAY_DB = 60.0
"""The response is cut where so little of its energy is left."""


@dataclass(frozen=True)
class Box:
    """A room, m and s; `tilt` is the share by which each octave above 1 kHz absorbs more and each below less."""

    size_m: tuple[float, float, float]
    rt60_s: float
    tilt: float = 0.08
    scattering: float = 0.3


@dataclass(frozen=True)
class Place:
    """The places of the two in a box: `distance_m` apart, in a direction of `turn` of a whole turn."""

    box: Box
    distance_m: float
    seed: int
    facing_db: float = 4.0
    """How much louder the direct sound is than an omnidirectional loudspeaker's; small boxes
    have 3 to 6 dB in the band of speech, where they face the listener."""
    drr_db: float | None = None
    """Instead of that: what the direct sound is scaled to."""
    door: Box | None = None
    """The room behind the door, where the microphone stands; then `distance_m` is from the speaker to the door and from
    there to the microphone."""

    @property
    def key(self) -> str:
        """Names the file of the response."""
        return hashlib.sha256(f"2 {self!r}".encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Acoustic:
    """Measures of a response: reverberation time (T20) and ratio of direct to reverberant energy."""

    rt60_s: float
    drr_db: float


def cache_folder() -> Path:
    """The folder of cached responses, by the XDG base directories."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "hvcpd" / "rooms"


@lru_cache(maxsize=64)
def response(place: Place, folder: Path | None = None) -> Response:
    """The impulse response from the speaker to the microphone, of energy 1, its direct sound at LEAD; from `folder` if
    it is there. Raises ImportError without pyroomacoustics."""
    path = (folder or cache_folder()) / f"{place.key}.npy"
    if path.exists():
        return np.asarray(np.load(path), np.float32)
    found = _computed(place)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(f".{os.getpid()}.npy")
    np.save(unfinished, found)
    unfinished.replace(path)
    return found


def _computed(place: Place) -> Response:
    near = _box(place.box, place.distance_m, place.seed)
    if place.door is not None:
        far = _box(place.door, place.distance_m, place.seed + 1)
        near = fftconvolve(near, far)[LEAD:]
    direct = near[: LEAD + DIRECT]
    if place.drr_db is None:
        direct *= 10.0 ** (place.facing_db / 20.0)
    else:
        wanted = 10.0 ** (place.drr_db / 10.0) * np.sum(near[LEAD + DIRECT :] ** 2)
        direct *= np.sqrt(wanted / np.sum(direct**2))
    left = np.cumsum(near[::-1] ** 2)[::-1]
    near = near[: int(np.argmax(left < left[0] * 10.0 ** (-DECAY_DB / 10.0))) or len(near)]
    return np.asarray(near / np.sqrt(np.sum(near**2)), np.float32)


def _box(box: Box, distance_m: float, seed: int) -> NDArray[np.float64]:
    """The response in one box, its direct sound at LEAD."""
    import pyroomacoustics as pra

    rng = np.random.default_rng(seed)
    pra.random.seed(seed)
    length, width, height = box.size_m
    volume, surface = length * width * height, 2 * (length * width + length * height + width * height)
    octaves = np.log2(np.array(OCTAVES_HZ) / 1000.0)
    # Eyring's: Sabine's absorption is too small where much is absorbed
    mean = 1.0 - np.exp(-0.161 * volume / (surface * box.rt60_s))
    absorption = np.clip(mean * (1.0 + box.tilt * octaves), 0.005, 0.99)
    room = pra.ShoeBox(
        list(box.size_m),
        fs=SAMPLE_RATE_HZ,
        materials=pra.Material({"coeffs": absorption.tolist(), "center_freqs": list(OCTAVES_HZ)}, box.scattering),
        max_order=3,
        ray_tracing=True,
        air_absorption=True,
    )
    room.set_ray_tracing(n_rays=8000, receiver_radius=0.3, energy_thres=1e-6)
    room.set_sound_speed(SOUND_SPEED_M_S)
    source, microphone = _positions(box, distance_m, rng)
    room.add_source(source)
    room.add_microphone(microphone)
    room.compute_rir()
    impulse = np.asarray(room.rir[0][0], np.float64)
    apart_m = float(np.linalg.norm(np.subtract(source, microphone)))
    at = pra.constants.get("frac_delay_length") // 2 + round(apart_m / SOUND_SPEED_M_S * SAMPLE_RATE_HZ)
    return impulse[at - LEAD :]


def _positions(box: Box, distance_m: float, rng: np.random.Generator) -> tuple[list[float], list[float]]:
    """Two places that far apart, as near to it as the box allows, 0.3 m from the walls at least."""
    size = np.array(box.size_m[:2])
    best: tuple[float, list[float], list[float]] | None = None
    for _ in range(400):
        one, other = (0.3 + rng.random(2) * (size - 0.6) for _ in range(2))
        heading = (other - one) / max(float(np.linalg.norm(other - one)), 1e-6)
        other = np.clip(one + distance_m * heading, 0.3, size - 0.3)
        miss_m = abs(float(np.linalg.norm(other - one)) - distance_m)
        if best is None or miss_m < best[0]:
            best = miss_m, [*one.tolist(), HEIGHT_M], [*other.tolist(), HEIGHT_M + 0.02]
        if miss_m < 0.02:
            break
    assert best is not None
    return best[1], best[2]


def measured(folder: Path) -> list[Path]:
    """The impulse responses below a folder of data, sorted."""
    return sorted((folder / "rooms").glob("*.wav"))


@lru_cache(maxsize=64)
def read_response(path: Path) -> Response:
    """A measured response of energy 1, from LEAD samples before its direct sound on."""
    impulse = read_wav(path).astype(np.float64)
    loud = np.abs(impulse) > 0.3 * np.max(np.abs(impulse))
    impulse = impulse[max(int(np.argmax(loud)) - LEAD, 0) :]
    return np.asarray(impulse / np.sqrt(np.sum(impulse**2)), np.float32)


def acoustic(impulse: Response) -> Acoustic:
    """Measures of a response; its direct sound is where `response` and `read_response` have it."""
    energy = impulse.astype(np.float64) ** 2
    direct, rest = float(np.sum(energy[: LEAD + DIRECT])), float(np.sum(energy[LEAD + DIRECT :]))
    return Acoustic(decay_s(impulse), 10.0 * float(np.log10(max(direct, 1e-12) / max(rest, 1e-12))))


def _like(rng: np.random.Generator, size_m: tuple[float, float, float], rt60_s: float, tilt: float = 0.08) -> Box:
    """A room such as this, its measures within 12 %."""
    length, width, height = (float(m * rng.uniform(0.88, 1.12)) for m in size_m)
    return Box((length, width, height), float(rt60_s * rng.uniform(0.9, 1.1)), tilt, float(rng.uniform(0.1, 0.5)))


def living_room(seed: int) -> Place:
    """RT60 about 0.8 s, 2.8 m apart."""
    rng = np.random.default_rng([seed, 1])
    return Place(_like(rng, (5.6, 4.4, 2.6), 0.8), 2.8, seed)


def next_room(seed: int) -> Place:
    """From a kitchen through a door to a room beside it."""
    rng = np.random.default_rng([seed, 2])
    kitchen, room = _like(rng, (3.8, 3.2, 2.5), 0.6, 0.03), _like(rng, (4.8, 4.0, 2.5), 0.5)
    return Place(kitchen, float(rng.uniform(1.5, 2.2)), seed, 0.0, float(rng.uniform(-12.0, -6.0)), room)


def classroom(seed: int) -> Place:
    """RT60 about 0.9 s, 6 m apart, the loudspeaker to the side."""
    rng = np.random.default_rng([seed, 3])
    return Place(_like(rng, (9.5, 7.5, 3.1), 0.9), float(rng.uniform(5.0, 7.0)), seed, 0.0)


def chapel(seed: int) -> Place:
    """RT60 about 2.3 s, 10 m apart, DRR from -16 to -8 dB."""
    rng = np.random.default_rng([seed, 4])
    box = _like(rng, (20.0, 10.0, 8.0), 2.3, 0.1)
    return Place(box, float(rng.uniform(8.0, 11.0)), seed, 0.0, float(rng.uniform(-16.0, -8.0)))


def draw_place(seed: int) -> Place:
    """Any room from 8 to 1,500 m³ with an RT60 from 0.2 to 2.3 s (the larger the longer), DRR from +7 to -27 dB."""
    rng = np.random.default_rng([seed, 5])
    scale = float(np.exp(rng.uniform(np.log(1.8), np.log(9.0))))
    size = (scale * rng.uniform(1.1, 2.0), scale * rng.uniform(0.8, 1.3), float(np.clip(scale * 0.7, 2.3, 8.0)))
    middle_s = 0.25 * (scale / 1.8) ** 1.15
    rt60_s = float(np.clip(middle_s * np.exp(rng.normal(0.0, 0.5)), 0.2, 2.3))
    longest_m = float(np.hypot(size[0] - 0.6, size[1] - 0.6))
    distance_m = float(np.clip(np.exp(rng.uniform(np.log(0.6), np.log(12.0))), 0.5, 0.9 * longest_m))
    drr_db = float(rng.uniform(-27.0, -10.0)) if rng.random() < 0.15 else None
    tilt, scattering, facing_db = (float(rng.uniform(*span)) for span in ((0, 0.15), (0.1, 0.6), (-4, 6)))
    box = Box((float(size[0]), float(size[1]), size[2]), rt60_s, tilt, scattering)
    return Place(box, distance_m, seed, facing_db, drr_db)
