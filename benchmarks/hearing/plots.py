"""The plots: accuracy against SNR and distance, cost against size. Ours drawn through, PocketSphinx's dashed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.hearing.cost import Cost
from benchmarks.hearing.table import Result

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#7f7f00")
"""Okabe & Ito's, which the colour-blind can tell apart; the last darkened."""
THEIRS = (0, (4, 2))


def _axes(rows: int, columns: int, size: tuple[float, float]) -> tuple[Any, Any]:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    pyplot.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = pyplot.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
    return figure, axes


def _legend(figure: Any) -> None:
    """A common legend above the panels."""
    from matplotlib.lines import Line2D

    grey: dict[str, Any] = {"color": "#444444", "ms": 4}
    lines = [
        Line2D([], [], marker="o", label="hvcpd", **grey),
        Line2D([], [], marker="s", mfc="white", ls=THEIRS, label="PocketSphinx", **grey),
    ]
    figure.legend(handles=lines, loc="outside upper left", ncols=2, frameon=False, fontsize=8)


def _save(figure: Any, path: Path) -> None:
    figure.savefig(path, dpi=130)


def _share(axes: Any, points: Sequence[Result], colour: str, label: str, peer: bool) -> None:
    scores = [(r.value, r.peer if peer else r.ours) for r in points]
    rows = [(x, s) for x, s in scores if s is not None]
    if not rows:
        return
    x = [value for value, _ in rows]
    style = {"ls": THEIRS, "marker": "s", "mfc": "white", "ms": 4} if peer else {"ls": "-", "marker": "o", "ms": 4}
    axes.plot(x, [100 * s.share for _, s in rows], color=colour, label=label, clip_on=False, **style)
    low, high = ([100 * s.interval[k] for _, s in rows] for k in (0, 1))
    axes.fill_between(x, low, high, color=colour, alpha=0.08 if peer else 0.15, lw=0)


def _decorate(axes: Any, xlabel: str, title: str, first: bool) -> None:
    axes.set(xlabel=xlabel, title=title, ylim=(0, 101))
    axes.grid(alpha=0.25)
    axes.axhline(95, color="black", lw=0.6, ls=":")
    if first:
        axes.set_ylabel("whole sentences right, %")


def draw_results(folder: Path, results: Sequence[Result]) -> None:
    """snr.png and distance.png in `folder`, each if there is something to draw."""
    noise = [r for r in results if r.group == "noise"]
    kinds = list(dict.fromkeys(r.name for r in noise))
    if kinds and len({r.value for r in noise}) > 1:
        figure, grid = _axes(1, len(kinds), (2.3 * len(kinds) + 0.6, 2.9))
        for axes, kind, colour in zip(grid[0], kinds, COLOURS, strict=False):
            here = sorted((r for r in noise if r.name == kind), key=lambda r: r.value)
            _share(axes, here, colour, "hvcpd", peer=False)
            _share(axes, here, colour, "PocketSphinx", peer=True)
            _decorate(axes, "SNR, dB", kind, axes is grid[0][0])
            axes.set_xlim(min(r.value for r in noise) - 1, max(r.value for r in noise) + 1)
        _legend(figure)
        _save(figure, folder / "snr.png")
    _draw_distance(folder, [r for r in results if r.group in ("range", "rooms")])


def _draw_distance(folder: Path, far: Sequence[Result]) -> None:
    from matplotlib.ticker import StrMethodFormatter

    names = list(dict.fromkeys(r.name for r in far))
    if not names:
        return
    figure, grid = _axes(1, len(names), (2.5 * len(names) + 0.6, 2.9))
    for axes, name, colour in zip(grid[0], names, COLOURS, strict=False):
        here = sorted((r for r in far if r.name == name), key=lambda r: r.value)
        _share(axes, here, colour, "hvcpd", peer=False)
        _share(axes, here, colour, "PocketSphinx", peer=True)
        _decorate(axes, "distance, m", name, axes is grid[0][0])
        axes.set_xscale("log")
        axes.set_xticks([0.5, 1, 2, 5, 10, *([20, 40] if name == "free field" else [])])
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.minorticks_off()
    _legend(figure)
    _save(figure, folder / "distance.png")


def draw_costs(folder: Path, found: Sequence[tuple[str, Cost]]) -> None:
    """cost.png in `folder`."""
    panels = [
        ("vocabulary", "words", "words", [c for row, c in found if row == "vocabulary"]),
        ("names", "names", "names", [c for row, c in found if row == "names" and c.words < 200]),
    ]
    shown = [panel for panel in panels if panel[3]]
    if not shown:
        return
    figure, grid = _axes(1, len(shown), (3.4 * len(shown) + 0.4, 2.9))
    for axes, (title, xlabel, what, costs) in zip(grid[0], shown, strict=True):
        for listener, colour, style in (("hvcpd", COLOURS[0], "-"), ("pocketsphinx", COLOURS[1], THEIRS)):
            here = [c for c in costs if c.listener == listener]
            if here:
                x = [getattr(c, what) for c in here]
                label = {"hvcpd": "hvcpd", "pocketsphinx": "PocketSphinx"}[listener]
                axes.plot(x, [c.speech for c in here], color=colour, ls=style, marker="o", ms=4, label=label)
        axes.set(xlabel=xlabel, title=f"cost against {title}", ylim=(0, None))
        axes.grid(alpha=0.25)
    grid[0][0].set_ylabel("processor time / speech")
    grid[0][0].legend(frameon=False, fontsize=8)
    _save(figure, folder / "cost.png")
