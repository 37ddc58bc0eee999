"""A picture of what was heard in a recording: spectrum, words and garbled speech, level and tracked noise, confidence.

Drawn with matplotlib, which comes with the extra `eval`; it is loaded only here.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hvcpd.errors import HvcpdError, how_to_install
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Garbled, Held, Recognised, Released, Urgent
from hvcpd.recognition.frontend import HOP_SAMPLES, WINDOW_SAMPLES, power_weights
from hvcpd.recognition.noise import NoiseTracker
from hvcpd.recognition.stream import FrameStream
from hvcpd.reporting.spectrogram import HOP, WINDOW, darkest_db, spectrogram

MAX_COLUMNS = 6000
"""Columns of the spectrum: of a long recording frames are left out, which nobody would see."""
LEVEL_STEP_DB = 2.0
"""Coarse enough for a file of half the size, too fine for the eye to mind."""
INCHES_A_SECOND = 1.5
"""Wide enough for the words of fluent speech to stand side by side."""
WIDTH_INCHES = (9.0, 60.0)
"""The narrowest and the widest picture: at 110 dots an inch, 1,000 to 6,600 points."""
HEIGHT_INCHES = 7.2
DOTS_AN_INCH = 110
QUIETEST_DBFS = -100.0
"""The front end's floor; below is rounding noise of 16 bits."""

_SOUND, _NOISE, _GARBLED, _INK = "#7d8da1", "#d9480f", "#868e96", "#22262b"
_SURE, _UNSURE = "#0a7355", "#c2255c"
_HALTS: dict[type[Event], str] = {Urgent: "stop", Released: "halt"}


class PlotError(HvcpdError):
    """A picture cannot be drawn; the message says why and what to do."""


@dataclass(frozen=True)
class Levels:
    """Power of each frame and of the noise tracked by then, dBFS, NaN while there is no estimate; shape (frames,)."""

    at_s: NDArray[np.float64]
    sound_dbfs: NDArray[np.float64]
    noise_dbfs: NDArray[np.float64]


def levels_of(sound: Samples) -> Levels:
    """Follow sound of shape (n,) with the recogniser's own front end and noise tracker."""
    stream, tracker, weights = FrameStream(), NoiseTracker(), power_weights()
    powers: list[NDArray[np.float32]] = []
    noise: list[float] = []
    for chunk in stream.push(sound, masked=False):
        tracker.push(chunk.energies)
        tracker.follow_step()
        powers.append(chunk.energies @ weights)
        noise += [float(tracker.estimate @ weights) if tracker.ready else float("nan")] * len(chunk.energies)
    frames = np.concatenate(powers) if powers else np.zeros(0, np.float32)
    at_s = (np.arange(len(frames)) * HOP_SAMPLES + WINDOW_SAMPLES / 2) / SAMPLE_RATE_HZ
    return Levels(at_s, _dbfs(frames.astype(np.float64)), _dbfs(np.array(noise)))


def _dbfs(power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of summed filterbank energies; a full-scale sine is -3 dBFS."""
    # Parseval for a one-sided spectrum: of a frame with mean power p, the bins add up to p * FFT / 2 * sum(window²).
    scale = 0.5 * 512 * float(np.square(np.hamming(WINDOW_SAMPLES)).sum())
    dbfs: NDArray[np.float64] = 10.0 * np.log10(np.maximum(power / scale, 10.0 ** (QUIETEST_DBFS / 10.0)))
    return dbfs


def spectrum_of(sound: Samples) -> NDArray[np.float64]:
    """The spectrogram of sound no shorter than a window, in MAX_COLUMNS columns at most."""
    return spectrogram(sound, max(HOP, -(-len(sound) // MAX_COLUMNS)))


def check_drawable(sound: Samples) -> None:
    """Raise PlotError when matplotlib is missing or the sound, shape (n,), is shorter than a window (25 ms)."""
    if len(sound) < WINDOW:
        raise PlotError(f"a recording of {len(sound)} samples is too short to be drawn; give one of 25 ms or more")
    try:
        import matplotlib.figure  # noqa: F401 - only to see whether it is there
    except ImportError as error:
        raise PlotError(f"--plot needs matplotlib, which is missing: {how_to_install('matplotlib')}") from error


def hearing_png(sound: Samples, events: Sequence[Event], title: str) -> bytes:
    """The picture as PNG of sound at 16 kHz, shape (n,), and what the recogniser reported of it.

    Raises PlotError as `check_drawable`.
    """
    check_drawable(sound)
    from matplotlib.figure import Figure

    length_s = len(sound) / SAMPLE_RATE_HZ
    width = float(np.clip(INCHES_A_SECOND * length_s + 1.2, *WIDTH_INCHES))
    figure = Figure(figsize=(width, HEIGHT_INCHES), dpi=DOTS_AN_INCH, layout="constrained", facecolor="white")
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(5, 2, 1.6))
    top.set_title(title, loc="left", fontsize=12, color=_INK, pad=34)
    _draw_spectrum(top, sound, length_s)
    _draw_levels(middle, levels_of(sound))
    _draw_confidence(bottom)
    for event in events:
        _draw_event((top, middle, bottom), event)
    for axes in (top, middle, bottom):
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(colors=_INK, labelsize=9)
    bottom.set_xlim(0.0, length_s)
    bottom.set_xlabel("time in s", color=_INK)
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": "hvcpctl hear"})
    return out.getvalue()


def _draw_spectrum(axes: Any, sound: Samples, length_s: float) -> None:
    level_db = spectrum_of(sound)
    extent = (0.0, length_s, 0.0, SAMPLE_RATE_HZ / 2000)
    stepped = np.round(level_db / LEVEL_STEP_DB) * LEVEL_STEP_DB
    image = axes.imshow(stepped, origin="lower", aspect="auto", extent=extent, cmap="magma", interpolation="nearest")
    image.set_clim(darkest_db(level_db), 0.0)
    axes.set_ylabel("kHz", color=_INK)


def _draw_levels(axes: Any, levels: Levels) -> None:
    axes.plot(levels.at_s, levels.sound_dbfs, color=_SOUND, linewidth=0.8, label="sound")
    axes.plot(levels.at_s, levels.noise_dbfs, color=_NOISE, linewidth=1.8, label="noise, tracked")
    above = levels.sound_dbfs > levels.noise_dbfs
    axes.fill_between(
        levels.at_s, levels.noise_dbfs, levels.sound_dbfs, where=above, color=_SOUND, alpha=0.25, linewidth=0
    )
    axes.set_ylabel("dBFS", color=_INK)
    axes.grid(axis="y", color="#e9ecef", linewidth=0.8)
    axes.legend(loc="upper right", fontsize=8, frameon=True, framealpha=0.9, edgecolor="none", ncols=2)


def _draw_confidence(axes: Any) -> None:
    axes.set_ylim(0.0, 1.4)
    axes.set_yticks([0.0, 0.5, 1.0], ["0", "50", "100"])
    axes.set_ylabel("confidence, %", color=_INK)
    axes.grid(axis="y", color="#e9ecef", linewidth=0.8)
    axes.set_axisbelow(True)


def _draw_event(axes: tuple[Any, Any, Any], event: Event) -> None:
    start_s, end_s = event.start_sample / SAMPLE_RATE_HZ, event.end_sample / SAMPLE_RATE_HZ
    top, middle, bottom = axes
    if isinstance(event, Held):
        return  # what became of it is told by another event
    if not isinstance(event, Recognised):
        for each in axes:
            each.axvspan(start_s, end_s, color=_GARBLED, alpha=0.25, linewidth=0)
        if isinstance(event, Garbled):
            _label(top, (start_s + end_s) / 2, "garbled", _GARBLED, italic=True)
        else:  # it may lie within a sentence, whose words are above the spectrum
            level = middle.get_xaxis_transform()
            middle.text(start_s, 1.02, _HALTS[type(event)], transform=level, fontsize=8, style="italic", color=_INK)
        return
    middle.axvspan(start_s, end_s, color=_SURE, alpha=0.07, linewidth=0)
    _draw_path(top, bottom, event)
    bottom.hlines(event.confidence, start_s, end_s, color=_INK, linewidth=1.2)
    words = f"{event.confidence:.0%}, {event.snr_db:.0f} dB SNR, voice {event.voice}"
    bottom.text(start_s, 1.1, words, fontsize=8, color=_INK, clip_on=True)


def _draw_path(top: Any, bottom: Any, event: Recognised) -> None:
    """The words of the winning path, each with its own confidence."""
    for span in event.spans:
        start_s, end_s = span.start_sample / SAMPLE_RATE_HZ, span.end_sample / SAMPLE_RATE_HZ
        colour = _SURE if span.confidence >= 0.5 else _UNSURE
        top.vlines([start_s, end_s], 0.0, SAMPLE_RATE_HZ / 2000, color="white", linewidth=0.7, alpha=0.65)
        _label(top, (start_s + end_s) / 2, span.word, _INK)
        bottom.bar(start_s, span.confidence, end_s - start_s, align="edge", color=colour, alpha=0.85, edgecolor="white")


def _label(axes: Any, at_s: float, text: str, colour: str, italic: bool = False) -> None:
    """A word above the spectrum, slanted, so that short words do not run into each other."""
    axes.annotate(
        text,
        (at_s, SAMPLE_RATE_HZ / 2000),
        xytext=(-2, 3),
        textcoords="offset points",
        rotation=32,
        rotation_mode="anchor",
        fontsize=9,
        color=colour,
        style="italic" if italic else "normal",
    )
