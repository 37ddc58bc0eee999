"""Writes the experiments' results as files: CSV, plots, and one HTML page that needs nothing else."""

from __future__ import annotations

import base64
import csv
import importlib.util
import io
from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from hvcpd.config.files import write_whole
from hvcpd.evaluation import plots
from hvcpd.evaluation.trials import Findings, Table
from hvcpd.reporting.markup import document, table, tag
from hvcpd.reporting.palette import own_file

STYLE = (
    "main{max-width:60rem;margin:0 auto;padding:1rem}table{border-collapse:collapse;font-size:.85rem}"
    "th,td{padding:.15rem .6rem;text-align:right;border-bottom:1px solid #8884}th:first-child,td:first-child,"
    "td.text,.beside *{text-align:left}img{max-width:100%;height:auto;background:#fff}.wide{overflow-x:auto}"
)
OPEN_ROWS = 20
"""A longer table is folded away."""


def plots_available() -> bool:
    """Whether matplotlib is installed."""
    return importlib.util.find_spec("matplotlib") is not None


def write_findings(name: str, found: Findings, folder: Path) -> None:
    """NAME.csv, NAME.txt and, if it has a plot and there is matplotlib, NAME.png and NAME.svg. Raises OSError."""
    write_whole(folder / f"{name}.csv", _csv(found.table).encode())
    write_whole(folder / f"{name}.txt", "\n".join((found.title, "", *found.paragraphs, "")).encode())
    if found.draw is not None and plots_available():
        plots.save(found.draw, found.assumptions, found.size_in, folder / name)


def _csv(table: Table) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return text.getvalue()


def write_page(found: Sequence[tuple[str, Findings]], about: str, folder: Path) -> Path:
    """Write report.html with all results and the plots in `folder`. Raises OSError."""
    title = "The paper's experiments, again"
    sections = (_section(name, one, folder / f"{name}.png") for name, one in found)
    main = tag("main", tag("h1", title), tag("p", about), _beside(found), *sections)
    path = folder / "report.html"
    write_whole(path, document(title, Markup(own_file("theme.css") + STYLE), main, loads="img-src data:").encode())
    return path


def _beside(found: Sequence[tuple[str, Findings]]) -> Markup | None:
    """The paper's figures and ours, each with a link to its section."""
    lines = [
        tag("tr", *(tag("td", cell) for cell in (tag("a", b.what, href=f"#{name}"), b.paper, b.here)))
        for name, one in found
        for b in one.beside
    ]
    return tag("div", table(("", "the paper", "here"), lines), class_="wide beside") if lines else None


def _section(name: str, found: Findings, picture: Path) -> Markup:
    plot = None
    if found.draw is not None and picture.exists():
        data = base64.b64encode(picture.read_bytes()).decode()
        plot = tag("img", src=Markup(f"data:image/png;base64,{data}"), alt=found.title)
    rows = [
        tag("tr", *(tag("td", str(c), class_="text" if isinstance(c, str) else None) for c in row))
        for row in found.table.rows
    ]
    shown = tag("div", table(found.table.columns, rows), class_="wide")
    if len(rows) > OPEN_ROWS:
        shown = tag("details", tag("summary", f"All {len(rows)} rows"), shown)
    assumptions = tag("ul", *(tag("li", text) for text in found.assumptions)) if found.assumptions else None
    simulated = tag("p", "Simulated, with these assumptions:") if found.assumptions else None
    paragraphs = (tag("p", text) for text in found.paragraphs)
    return tag("section", tag("h2", found.title), *paragraphs, plot, simulated, assumptions, shown, id=name)
