"""Pictures of utterances: how much of each frequency there is, over time."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.reporting.audio_clip import slice_of
from hvcpd.reporting.markup import joined, tag
from hvcpd.reporting.story import Line, Story
from hvcpd.reporting.text import clock

WINDOW = 400
"""Samples, 25 ms: its 60 Hz of bandwidth shows formants and, in low voices, harmonics."""
FFT = 512
HOP = 96
"""Samples, 6 ms: a plosive's burst (10 ms) keeps a column of its own."""
PRE_EMPHASIS = 0.97
"""6 dB an octave above 80 Hz, as phonetics programs show speech: the upper formants become visible."""
MAX_RANGE_DB = 60.0
"""From the loudest point to the darkest colour; less if the noise lies higher."""
NOISE_SHARE = 0.10
"""Share of all points, the quietest, that is drawn in the darkest colours."""
LEVELS = 48
"""Colours: steps of about 1 dB, which the eye does not tell apart, and pictures of half the size of 256 colours."""
MARGIN_S = 0.25
"""Shown before and after an utterance."""
MAX_PICTURES = 6
"""About 90 kB each in the page."""
MAX_LENGTH_S = 12.0
"""Longer utterances are cut."""

_LEFT, _TOP, _WIDTH, _HEIGHT, _BELOW = 46, 30, 800, 256, 40
_BAR_X = _LEFT + _WIDTH + 14


def spectrogram(sound: Samples, hop: int = HOP) -> NDArray[np.float64]:
    """Levels of sound, shape (n,), at 16 kHz, every `hop` samples: shape (frequencies, frames), 0 to 8 kHz, dB re the
    loudest point; Hann window. ValueError if it is shorter than a window."""
    if len(sound) < WINDOW:
        raise ValueError(f"{len(sound)} samples are fewer than the {WINDOW} of a window")
    emphasised = np.append(sound[:1], sound[1:] - PRE_EMPHASIS * sound[:-1]).astype(np.float64)
    frames = np.lib.stride_tricks.sliding_window_view(emphasised, WINDOW)[::hop] * np.hanning(WINDOW)
    power = np.square(np.abs(np.fft.rfft(frames, FFT, axis=1))).T
    loudest = max(float(power.max()), 1e-30)
    level_db: NDArray[np.float64] = 10.0 * np.log10(np.maximum(power / loudest, 1e-12))
    return level_db


def darkest_db(level_db: NDArray[np.float64]) -> float:
    """The level that a spectrogram's darkest colour stands for."""
    return float(np.clip(np.quantile(level_db, NOISE_SHARE), -MAX_RANGE_DB, -1.0))


def picture(level_db: NDArray[np.float64]) -> tuple[bytes, float]:
    """The spectrogram as PNG, low frequencies at the bottom, and its range in dB."""
    floor_db = darkest_db(level_db)
    scaled = np.clip(1.0 - level_db / floor_db, 0.0, 1.0) * (LEVELS - 1)
    return encode_png(np.rint(scaled[::-1]).astype(np.uint8), magma(LEVELS)), -floor_db


def choose(story: Story, sound: Samples) -> list[Line]:
    """Return the utterances to draw, the best first: each robot's clearest long one, a collision, then other clear
    ones; of sound of shape (n,), float32."""
    worth: dict[int, float] = {}
    for said in (line.said for line in story.lines):
        part = sound[slice_of(said.at_s, said.end_s, len(sound))]
        if len(part) >= 2 * WINDOW:
            power = float(np.mean(np.square(part, dtype=np.float64)))
            worth[said.utterance] = min(said.end_s - said.at_s, 4.0) * float(np.log1p(power / 1e-8))
    lines = [line for line in story.lines if line.said.utterance in worth]
    collided = [line for line in lines if line.said.collided]
    clear = [line for line in lines if not line.said.collided]
    clear.sort(key=lambda line: (not line.heard, -worth[line.said.utterance], line.said.at_s))
    firsts = [
        next((line for line in clear if line.said.speaker == robot), None) for robot in story.robots[: MAX_PICTURES - 2]
    ]
    chosen = {line.said.utterance: line for line in (*firsts, *collided[:1], *clear) if line is not None}
    return list(chosen.values())[:MAX_PICTURES]


def figure(line: Line, sound: Samples) -> Markup:
    """Return an utterance's spectrogram, from sound of shape (n,), float32, with axes, and above it the words where
    a listener recognised them."""
    begin_s = max(line.said.at_s - MARGIN_S, 0.0)
    end_s = min(line.said.end_s + MARGIN_S, begin_s + MAX_LENGTH_S)
    part = sound[slice_of(begin_s, end_s, len(sound))]
    png, range_db = picture(spectrogram(part))
    length_s = len(part) / SAMPLE_RATE_HZ
    image = tag(
        "image",
        href="data:image/png;base64," + base64.b64encode(png).decode("ascii"),
        x=_LEFT,
        y=_TOP,
        width=_WIDTH,
        height=_HEIGHT,
        preserveAspectRatio="none",
    )
    title = f"Spectrogram of {line.said.speaker} saying: {line.said.text}"
    return tag(
        "svg",
        tag("title", title),
        image,
        _time_axis(length_s, begin_s),
        _frequency_axis(),
        _colour_bar(range_db),
        _words(line, begin_s, length_s),
        class_="spectrogram",
        viewBox=f"0 0 {_BAR_X + 56} {_TOP + _HEIGHT + _BELOW}",
        role="img",
    )


def _time_axis(length_s: float, begin_s: float) -> Markup:
    step_s = 0.5 if length_s <= 8 else 1.0
    parts = []
    for k in range(int(length_s / step_s + 1e-9) + 1):
        x = _LEFT + _WIDTH * k * step_s / length_s
        y = _TOP + _HEIGHT
        parts.append(tag("line", class_="tick", x1=x, x2=x, y1=y, y2=y + 5))
        parts.append(tag("text", f"{k * step_s:.1f}", x=x, y=y + 18, text_anchor="middle"))
    where = f"time in s after {clock(begin_s)}"
    label = tag("text", where, x=_LEFT + _WIDTH / 2, y=_TOP + _HEIGHT + 35, text_anchor="middle")
    return joined([*parts, label])


def _frequency_axis() -> Markup:
    parts, top_hz = [], SAMPLE_RATE_HZ / 2
    for khz in range(0, int(top_hz / 1000) + 1, 2):
        y = _TOP + _HEIGHT * (1.0 - 1000 * khz / top_hz)
        parts.append(tag("line", class_="tick", x1=_LEFT - 5, x2=_LEFT, y1=y, y2=y))
        parts.append(tag("text", khz, x=_LEFT - 9, y=y + 4, text_anchor="end"))
    middle = _TOP + _HEIGHT / 2
    turned = f"rotate(-90 14 {middle:g})"
    return joined([*parts, tag("text", "kHz", x=14, y=middle, text_anchor="middle", transform=turned)])


def _colour_bar(range_db: float) -> Markup:
    parts = []
    colours = magma(LEVELS)[::-1]
    for k, (r, g, b) in enumerate(colours):
        y = _TOP + _HEIGHT * k / LEVELS
        fill = f"#{r:02x}{g:02x}{b:02x}"
        parts.append(tag("rect", x=_BAR_X, y=y, width=10, height=_HEIGHT / LEVELS + 0.6, fill=fill))
    for text, y in (("0 dB", _TOP + 10), (f"−{range_db:.0f}", _TOP + _HEIGHT)):
        parts.append(tag("text", text, x=_BAR_X + 14, y=y))
    return joined(parts)


def _words(line: Line, begin_s: float, length_s: float) -> Markup:
    """Of the listener who was surest; nothing if nobody kept account of the words."""
    best = max((h for h in line.heard if h.words), key=lambda h: h.confidence, default=None)
    if best is None:
        return Markup()
    parts = []
    for word, from_s, to_s in best.words:
        x1, x2 = (_LEFT + _WIDTH * min(max((at_s - begin_s) / length_s, 0.0), 1.0) for at_s in (from_s, to_s))
        parts += [tag("line", class_="word", x1=x, x2=x, y1=_TOP - 4, y2=_TOP + _HEIGHT) for x in (x1, x2)]
        parts.append(tag("text", word, class_="word", x=(x1 + x2) / 2, y=_TOP - 9, text_anchor="middle"))
    return joined(parts)


MAGIC = b"\x89PNG\r\n\x1a\n"
_INDEXED = 3

MAGMA = "000004 180f3e 451077 721f81 9f2f7f cd4071 f1605d fd9567 fec98d fcfdbf".split()
"""Ten of the stops of the colour map "magma" (van der Walt & Smith 2015, CC0): evenly rising in lightness, legible to
the colour-blind and in grey print."""


def magma(levels: int) -> NDArray[np.uint8]:
    """The colour map in `levels` steps: shape (levels, 3), RGB, uint8."""
    stops = np.array([[int(stop[i : i + 2], 16) for i in (0, 2, 4)] for stop in MAGMA], dtype=np.float64)
    at = np.linspace(0.0, len(stops) - 1.0, levels)
    channels = [np.interp(at, np.arange(len(stops)), stops[:, c]) for c in range(3)]
    return np.rint(np.stack(channels, axis=1)).astype(np.uint8)


def encode_png(pixels: NDArray[np.uint8], palette: NDArray[np.uint8]) -> bytes:
    """A picture: `pixels`, shape (height, width), are rows of `palette`, shape (k, 3), RGB. ValueError if empty."""
    height, width = pixels.shape
    if height == 0 or width == 0 or not 0 < len(palette) <= 256 or int(pixels.max()) >= len(palette):
        raise ValueError(f"no picture of {width} × {height} pixels with {len(palette)} colours")
    rows = np.zeros((height, width + 1), dtype=np.uint8)  # each row after its filter's number, 0: none
    rows[:, 1:] = pixels
    header = struct.pack(">IIBBBBB", width, height, 8, _INDEXED, 0, 0, 0)
    chunks = [
        (b"IHDR", header),
        (b"PLTE", palette.tobytes()),
        (b"IDAT", zlib.compress(rows.tobytes(), 9)),
        (b"IEND", b""),
    ]
    return MAGIC + b"".join(_chunk(kind, data) for kind, data in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
