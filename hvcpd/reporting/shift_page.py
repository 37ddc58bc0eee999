"""The report of a shift: as text, and as one HTML page with plots that needs nothing but a browser."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from hvcpd.language import messages as m
from hvcpd.reporting.files import write_whole
from hvcpd.reporting.markup import Markup, joined, tag
from hvcpd.reporting.palette import plant_colour, robot_slot
from hvcpd.reporting.shift import Member, Shift
from hvcpd.reporting.style import style_sheet
from hvcpd.reporting.text import clean, listed, percent, plural
from hvcpd.reporting.timeline_svg import draw_timeline

_WIDTH, _HEIGHT, _LEFT, _BOTTOM = 1080.0, 200.0, 44.0, 26.0
"""Of the chart of talk, SVG units."""


def write_shift(shift: Shift, path: Path) -> None:
    """Write the page. Raises OSError."""
    write_whole(path, page(shift).encode("utf-8"))


SHORT_S = 1800.0
"""In a shift shorter than this, seconds are told, too."""


def wall_clock(wall_s: float, seconds: bool = False) -> str:
    """Hours and minutes, by the clock of this computer."""
    return datetime.fromtimestamp(wall_s).strftime("%H:%M:%S" if seconds else "%H:%M")


def title(shift: Shift) -> str:
    """Whose shift, and when."""
    day = datetime.fromtimestamp(shift.begin_s).strftime("%A %d %B %Y")
    return f"{day}, {wall_clock(shift.begin_s)} to {wall_clock(shift.end_s)}, as {shift.own} heard it"


def as_text(shift: Shift) -> str:
    """The shift for the terminal."""
    lines = [clean(title(shift)), ""]
    lines += [f"{what:24}{value}" for value, what in _figures(shift)]
    lines += ["", f"{'':12}{'said':>6}{'sure':>8}  {'done':24}last report"]
    for member in shift.members:
        sure = percent(member.confidence) if member.confidence is not None else "–"
        lines.append(f"{clean(member.name):12}{member.sentences:6}{sure:>8}  {_numbers(member):24}{_report(member)}")
    if shift.troubles:
        lines += ["", "What went wrong:"]
        lines += [f"  {wall_clock(trouble.wall_s)}  {clean(trouble.text)}" for trouble in shift.troubles]
    if shift.unknown:
        told = plural(shift.unknown, "sentence")
        lines += ["", f"{told} not in today's phrasebook; give the names of then with --config"]
    return "\n".join(lines) + "\n"


def as_json(shift: Shift) -> dict[str, object]:
    """The shift for programs."""
    return {
        "own": shift.own,
        "begin_s": shift.begin_s,
        "end_s": shift.end_s,
        "sentences": shift.sentences,
        "garbled": shift.garbled,
        "unknown": shift.unknown,
        "done": dict(shift.done),
        "members": [
            {
                "name": member.name,
                "team": member.team,
                "sentences": member.sentences,
                "confidence": member.confidence,
                "done": member.done,
                "failed": member.failed,
                "doing": member.report.doing.value if member.report else None,
                "battery_v": member.report.battery_v if member.report else None,
            }
            for member in shift.members
        ],
        "troubles": [vars(trouble) for trouble in shift.troubles],
    }


def page(shift: Shift) -> str:
    """The page; a content security policy forbids it to load anything, and it has no script."""
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    head = (
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("title", f"Shift: {title(shift)}"),
        tag("style", style_sheet("theme.css", "report.css", "shift.css")),
    )
    figures = tag("dl", *(tag("div", tag("dt", what), tag("dd", value)) for value, what in _figures(shift)))
    header = tag(
        "header", tag("h1", "The shift"), tag("p", title(shift), class_="setting"), _classed(figures, "figures")
    )
    sections = [("Who did what when", _timeline(shift)), ("How they understood each other", _talk(shift))]
    sections += [("Who was there", _members(shift)), ("Tasks", _tasks(shift)), ("What went wrong", _troubles(shift))]
    main = tag("main", *(tag("section", tag("h2", heading), content) for heading, content in sections))
    return f"<!doctype html>\n{tag('html', tag('head', *head), tag('body', header, main), lang='en')}\n"


def _classed(element: Markup, kind: str) -> Markup:
    return Markup(element.replace("<dl>", f'<dl class="{kind}">', 1))


def _figures(shift: Shift) -> list[tuple[str, str]]:
    heard = shift.sentences + shift.garbled
    understood = percent(shift.sentences / heard) if heard else "–"
    return [
        (str(sum(shift.done.values())), "tasks done"),
        (str(shift.sentences), "sentences understood"),
        (str(shift.garbled), "not understood"),
        (understood, "of all speech understood"),
        (str(len(shift.troubles)), "troubles"),
    ]


def _timeline(shift: Shift) -> Markup:
    if not shift.story.lines:
        return tag("p", "Nobody said anything.")
    short = shift.end_s - shift.begin_s < SHORT_S
    return draw_timeline(shift.story, [], lambda at_s: wall_clock(shift.begin_s + at_s, short))


def _talk(shift: Shift) -> Markup:
    """A bar for each part of the shift: what was understood, and on top of it what was not."""
    short = shift.end_s - shift.begin_s < SHORT_S
    most = max((b.understood + b.garbled for b in shift.bins), default=0) or 1
    wide = (_WIDTH - _LEFT) / max(len(shift.bins), 1)
    scale = (_HEIGHT - _BOTTOM - 12.0) / most
    base = _HEIGHT - _BOTTOM
    parts = [tag("text", str(most), class_="scale", x=_LEFT - 6, y=22, text_anchor="end")]
    parts.append(tag("line", class_="grid", x1=_LEFT, x2=_WIDTH, y1=base, y2=base))
    for k, part in enumerate(shift.bins):
        x = _LEFT + k * wide
        low, high = part.understood * scale, part.garbled * scale
        told = f"from {wall_clock(part.from_s)}: {part.understood} understood, {part.garbled} not"
        bars = [tag("rect", class_="understood", x=x + 1, y=base - low, width=wide - 2, height=low)]
        bars.append(tag("rect", class_="garbled", x=x + 1, y=base - low - high, width=wide - 2, height=high))
        parts.append(tag("g", tag("title", told), *bars))
        if k % 4 == 0:
            parts.append(tag("text", wall_clock(part.from_s, short), class_="scale", x=x, y=_HEIGHT - 8))
    words = "Sentences understood and not understood over the shift"
    chart = tag(
        "svg", tag("title", words), *parts, class_="talk-chart", viewBox=f"0 0 {_WIDTH:g} {_HEIGHT:g}", role="img"
    )
    keys = [("understood-key", "understood"), ("garbled-key", "not understood")]
    legend = (tag("span", tag("i", class_=f"swatch {kind}"), f" {text}") for kind, text in keys)
    return joined([chart, tag("p", *legend, class_="legend")])


def _members(shift: Shift) -> Markup:
    heads = ("Name", "Team", "Sentences", "How sure", "Tasks done", "Last report")
    rows = []
    for k, member in enumerate(shift.members):
        sure = percent(member.confidence) if member.confidence is not None else "–"
        cells = (member.team or "–", str(member.sentences), sure, _numbers(member) or "–", _report(member) or "–")
        name = tag("th", tag("b", member.name, class_=f"r{robot_slot(k)}"), scope="row")
        rows.append(tag("tr", name, *(tag("td", c, data_head=h) for h, c in zip(heads[1:], cells, strict=True))))
    return tag("table", tag("thead", tag("tr", *(tag("th", h, scope="col") for h in heads))), tag("tbody", *rows))


def _tasks(shift: Shift) -> Markup:
    heads = ("Task", "No.", "Done by", "At")
    rows = []
    for task in shift.story.tasks:
        dot = tag("svg", tag("circle", cx=5, cy=5, r=4.4, fill=plant_colour(task.name)), viewBox="0 0 10 10", width=11)
        doers = listed(dict.fromkeys(act.robot for act in task.waterings)) or "nobody"
        at = ", ".join(wall_clock(shift.begin_s + act.at_s) for act in task.waterings) or "–"
        name = tag("th", tag("span", dot, class_="dot"), task.name, scope="row")
        cells = zip(heads[1:], (str(task.number), doers, at), strict=True)
        rows.append(tag("tr", name, *(tag("td", text, data_head=head) for head, text in cells)))
    return tag("table", tag("thead", tag("tr", *(tag("th", h, scope="col") for h in heads))), tag("tbody", *rows))


def _troubles(shift: Shift) -> Markup:
    if not shift.troubles:
        return tag("p", "Nothing.")
    rows = [tag("li", tag("time", wall_clock(trouble.wall_s)), trouble.text) for trouble in shift.troubles]
    return tag("ul", *rows, class_="troubles")


def _numbers(member: Member) -> str:
    return ", ".join(map(str, member.done))


def _report(member: Member) -> str:
    report = member.report
    if report is None:
        return ""
    task = f" at task {report.task.number}" if report.task is not None else ""
    doing = {m.Doing.WORKING: "works"}.get(report.doing, report.doing.value)
    battery = f", battery {report.battery_v:g} V" if report.battery_v is not None else ""
    return f"{doing}{task}{battery}"
