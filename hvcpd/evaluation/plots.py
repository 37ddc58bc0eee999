"""Plots with matplotlib (the `eval` extra): shares with their intervals, and the assumptions below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hvcpd.evaluation.listeners import OURS, PEER, PORCUPINE
from hvcpd.evaluation.statistics import Pivot, Step, wilson

COLOURS = {OURS: "#0072b2", PEER: "#d55e00", PORCUPINE: "#009e73"}
"""Okabe & Ito's, which the colour-blind can tell apart."""
OTHERS = ("#009e73", "#cc79a7", "#7f7f00", "#56b4e9", "#e69f00")
STYLES = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))
PNG_DPI = 130


@dataclass(frozen=True)
class Series:
    """One listener's results in one condition."""

    condition: str
    listener: str
    steps: tuple[Step, ...]
    pivot: Pivot


def save(draw: Any, assumptions: Sequence[str], size_in: tuple[float, float], path: Path) -> None:
    """`path` with .png and .svg: what `draw` makes of a figure, with the assumptions below it. Raises OSError."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    style = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": path.name}
    with pyplot.rc_context(style):
        figure = pyplot.figure(figsize=size_in, layout="constrained")
        draw(figure)
        if assumptions:
            figure.supxlabel("\n".join(("Simulated:", *assumptions)), fontsize=6.5, color="#444444", x=0.01, ha="left")
        figure.savefig(path.with_suffix(".png"), dpi=PNG_DPI)
        figure.savefig(path.with_suffix(".svg"), metadata={"Date": None})
        pyplot.close(figure)


def shares(axes: Any, series: Sequence[Series], xlabel: str, ylabel: str) -> None:
    """Lines with their intervals, and a legend."""
    conditions = list(dict.fromkeys(s.condition for s in series))
    for s in series:
        x = np.array([step.at for step in s.steps])
        percent = [100 * step.right / step.n for step in s.steps]
        low, high = (np.array([100 * wilson(step.right, step.n)[end] for step in s.steps]) for end in (0, 1))
        colour = COLOURS.get(s.listener, OTHERS[0])
        style = STYLES[conditions.index(s.condition) % len(STYLES)]
        label = s.listener if len(conditions) == 1 else f"{s.listener}, {s.condition}"
        axes.plot(x, percent, color=colour, ls=style, marker="o", ms=3.5, lw=1.2, label=label)
        axes.fill_between(x, low, high, color=colour, alpha=0.12, lw=0)
    axes.set(xlabel=xlabel, ylabel=ylabel, ylim=(-2, 102))
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize=8, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def against_distance(
    figure: Any, series: Sequence[Series], ylabel: str, paper_m: float, paper: str = "the paper's pivotal\ndistance,"
) -> None:
    """Shares against distance (m, logarithmic), with the paper's distance marked for what it is."""
    axes = figure.add_subplot()
    shares(axes, series, "distance, m", ylabel)
    mark(axes, paper_m, f"{paper} {paper_m * 100:.0f} cm")
    by_distance(axes, series)


def mark(axes: Any, at: float, text: str) -> None:
    """A dotted line at a distance of the paper's."""
    axes.axvline(at, color="black", lw=0.8, ls=":")
    axes.annotate(text, (at, 45), xytext=(4, 0), textcoords="offset points", fontsize=7)


def by_distance(axes: Any, series: Sequence[Series]) -> None:
    """A logarithmic axis of distances, m."""
    from matplotlib.ticker import StrMethodFormatter

    axes.set_xscale("log")
    distances = sorted({step.at for s in series for step in s.steps})
    axes.set_xlim(distances[0] / 1.1, distances[-1] * 1.1)
    axes.set_xticks(distance_ticks(distances))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.minorticks_off()


def distance_ticks(distances: Sequence[float]) -> list[float]:
    """Round numbers within the range of these, ascending; or these themselves where they span too little."""
    decades = (0.1, 1.0, 10.0, 100.0, 1000.0)
    within = [k * x for x in decades for k in (1, 2, 5) if distances[0] <= k * x <= distances[-1]]
    return within if len(within) > 1 else list(distances)
