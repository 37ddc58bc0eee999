"""The report of a shift: as text, and as one HTML page with plots that needs nothing but a browser."""

from __future__ import annotations

from collections import Counter
from datetime import datetime
from pathlib import Path

from markupsafe import Markup

from hvcpd.config.files import write_whole
from hvcpd.language import messages as m
from hvcpd.reporting.icons import badge
from hvcpd.reporting.markup import document, escaped, figure_list, joined, row, table, tag
from hvcpd.reporting.occurrences import Occurrence
from hvcpd.reporting.palette import robot_slot, style_sheet
from hvcpd.reporting.shift import Member, Shift
from hvcpd.reporting.text import clean, columns, percent, plural, task_words
from hvcpd.reporting.timeline_svg import draw_timeline

SHORT_S = 1800.0
"""Length of a shift below which times are shown with seconds."""
DAY_S = 86400.0
_UNITS_PER_S = 0.15
"""Scale of the timeline, SVG units per second: a task of four minutes has room for its number, two hours are visible at
once."""
MAX_LISTED = 6
"""Tasks that stand beside a member at once; of more the page tells the number, and the tasks on demand."""
DUE_HEADS = ("Due", "Task", "Outcome", "Carried out")
LABEL_EVERY = 4
"""Bars of the chart of talk to one time below it."""


def write_shift(shift: Shift, path: Path) -> None:
    """Write the page. Raises OSError."""
    write_whole(path, page(shift).encode("utf-8"))


def wall_clock(wall_s: float, shift: Shift) -> str:
    """A time of the shift by the clock of this computer: as much of it as the shift's length asks for."""
    began, ended, at = map(datetime.fromtimestamp, (shift.begin_s, shift.end_s, wall_s))
    day = "%a " if began.date() != ended.date() else ""
    if shift.end_s - shift.begin_s > 6 * DAY_S:
        day = "%-d %b " if began.year == ended.year else "%-d %b %Y "
    return at.strftime(day + ("%H:%M:%S" if shift.end_s - shift.begin_s < SHORT_S else "%H:%M"))


def title(shift: Shift) -> str:
    """Whose shift, and when."""
    began, ended = datetime.fromtimestamp(shift.begin_s), datetime.fromtimestamp(shift.end_s)
    day = "%A %-d %B %Y, %H:%M"
    until = day if began.year != ended.year else "%H:%M" if began.date() == ended.date() else "%A %-d %B, %H:%M"
    return f"{began.strftime(day)} to {ended.strftime(until)}, as {shift.own} heard it"


def as_text(shift: Shift) -> str:
    """The shift for the terminal."""
    lines = [clean(title(shift)), "", *columns(_figures(shift), right=(0,)), ""]
    heads = ("Name", "Team", "Sentences", "Sure", "Last report")
    lines += columns([heads, *(_member_cells(member) for member in shift.members)], right=(2, 3))
    if shift.due:
        rows = [DUE_HEADS, *(_due_cells(shift, each) for each in shift.due)]
        lines += ["", f"What was due: {_due_sum(shift)}", *(f"  {line}" for line in columns(rows))]
    elif shift.story.performed:
        done = [
            (wall_clock(shift.begin_s + act.at_s, shift), act.robot, _task(shift, act.task))
            for act in shift.story.performed
        ]
        lines += ["", "Tasks done:", *(f"  {line}" for line in columns(done))]
    if shift.troubles:
        troubles = [(wall_clock(trouble.wall_s, shift), trouble.text) for trouble in shift.troubles]
        lines += ["", "What went wrong:", *(f"  {line}" for line in columns(troubles))]
    if shift.unknown:
        text = plural(shift.unknown, "sentence")
        lines += ["", f"{text} not in today's phrasebook; give the names of that time with --config"]
    return "\n".join(lines) + "\n"


def as_json(shift: Shift) -> dict[str, object]:
    """The shift for programs."""
    return {
        "own": shift.own,
        "begin_s": shift.begin_s,
        "end_s": shift.end_s,
        "said": shift.said,
        "heard": shift.heard,
        "garbled": shift.garbled,
        "unknown": shift.unknown,
        "done": dict(shift.done),
        "due": [
            {"task": each.number, "due_s": each.due_s, "became": each.became, "deeds": each.deeds} for each in shift.due
        ],
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
    """The page; it has no script."""
    figures = figure_list(_figures(shift))
    header = tag("header", tag("h1", "The shift"), tag("p", title(shift), class_="setting"), figures)
    sections = [("Who did what when", _timeline(shift)), ("How they understood each other", _talk(shift))]
    sections += [("What was due", _due(shift))] if shift.due else []
    sections += [("Who was there", _members(shift)), ("Tasks", _tasks(shift)), ("What went wrong", _troubles(shift))]
    main = tag("main", *(tag("section", tag("h2", heading), content) for heading, content in sections))
    style = style_sheet("theme.css", "report.css", "shift.css")
    return document(f"Shift: {title(shift)}", style, header, main)


def _figures(shift: Shift) -> list[tuple[str, str]]:
    done, troubles = shift.done.total(), len(shift.troubles)
    understood = percent(shift.understood) if shift.understood is not None else "–"
    return [
        (str(done), "task done" if done == 1 else "tasks done"),
        (str(shift.said), f"said by {shift.own}"),
        (str(shift.heard), "understood from others"),
        (str(shift.garbled), "not understood"),
        (understood, "understood of the speech heard"),
        (str(troubles), "trouble" if troubles == 1 else "troubles"),
    ]


def _timeline(shift: Shift) -> Markup:
    if not shift.story.lines:
        return tag("p", "Nobody said anything.")
    midnight = datetime.fromtimestamp(shift.begin_s).replace(hour=0, minute=0, second=0, microsecond=0)
    since_midnight_s = shift.begin_s - midnight.timestamp()
    return draw_timeline(
        shift.story, [], lambda at_s: wall_clock(shift.begin_s + at_s, shift), since_midnight_s, _UNITS_PER_S
    )


def _talk(shift: Shift) -> Markup:
    """A bar for each part of the shift: what was understood, and on top of it what was not."""
    most = max((b.heard + b.garbled for b in shift.bins), default=0)
    if not most:
        return tag("p", "Nobody was heard.")
    bars, times = [], []
    for k, part in enumerate(shift.bins):
        text = f"from {wall_clock(part.from_s, shift)}: {part.heard} understood, {part.garbled} not"
        kinds = (("garbled", part.garbled), ("understood", part.heard))
        pieces = (tag("i", class_=kind, style=f"height:{100 * n / most:.2f}%") for kind, n in kinds if n)
        bars.append(tag("div", *pieces, title=text))
        if k % LABEL_EVERY == 0:
            times.append(tag("span", wall_clock(part.from_s, shift)))
    words = "Sentences understood and not understood over the shift"
    chart = tag("div", tag("div", *bars, class_="bars"), tag("div", *times, class_="times"), class_="talk-chart")
    keys = [("understood-key", "understood"), ("garbled-key", "not understood")]
    legend = [tag("span", tag("i", class_=f"swatch {kind}"), f" {text}") for kind, text in keys]
    legend.append(tag("span", f"the highest bar: {most}"))
    return joined([tag("div", chart, role="img", aria_label=words), tag("p", *legend, class_="legend")])


def _member_cells(member: Member) -> tuple[str, str, str, str, str]:
    sure = percent(member.confidence) if member.confidence is not None else "–"
    return member.name, member.team or "–", str(member.sentences), sure, _report(member) or "–"


def _members(shift: Shift) -> Markup:
    heads = ("Name", "Team", "Sentences", "How sure", "Last report", "Tasks done")
    rows = []
    for k, member in enumerate(shift.members):
        name, *cells = _member_cells(member)
        rows.append(row(heads, [tag("b", name, class_=f"r{robot_slot(k)}"), *cells, _deeds(shift, member)]))
    return table(heads, rows)


def _deeds(shift: Shift, member: Member) -> Markup:
    """Which tasks somebody did, by number and name; a task that was done twice stands there twice."""
    if not member.done:
        return escaped("–")
    deeds = tag("ul", *(tag("li", _task(shift, number)) for number in member.done))
    if len(member.done) <= MAX_LISTED:
        return deeds
    return tag("details", tag("summary", plural(len(member.done), "task")), deeds)


def _tasks(shift: Shift) -> Markup:
    heads = ("No.", "Task", "Done")
    rows = []
    done_often = shift.done
    for task in shift.story.tasks:
        acts = [f"{wall_clock(shift.begin_s + act.at_s, shift)} by {act.robot}" for act in task.performed]
        half = "half done: " if acts and not done_often[task.number] else ""
        done = half + (", ".join(acts) or "no report heard")
        rows.append(row(heads, [task.number, joined([badge(task.icon, task.name), task.name]), done], 1))
    return table(heads, rows)


def _due_cells(shift: Shift, each: Occurrence) -> tuple[str, str, str, str]:
    deeds = ", ".join(f"{wall_clock(at_s, shift)} by {by}" for at_s, by in each.deeds)
    return wall_clock(each.due_s, shift), f"task {each.number}, {each.name}", each.became, deeds or "–"


def _due_sum(shift: Shift) -> str:
    counts = Counter(each.became for each in shift.due)
    return ", ".join(f"{n} {became}" for became, n in counts.most_common())


def _due(shift: Shift) -> Markup:
    rows = (row(DUE_HEADS, _due_cells(shift, each)) for each in shift.due)
    return joined([tag("p", _due_sum(shift)), table(DUE_HEADS, rows)])


def _troubles(shift: Shift) -> Markup:
    if not shift.troubles:
        return tag("p", "Nothing.")
    rows = [tag("li", tag("time", wall_clock(trouble.wall_s, shift)), f" {trouble.text}") for trouble in shift.troubles]
    return tag("ul", *rows, class_="troubles")


def _task(shift: Shift, number: int) -> str:
    return task_words(number, next((task.name for task in shift.story.tasks if task.number == number), None))


def _report(member: Member) -> str:
    report = member.report
    if report is None:
        return ""
    task = f" at task {report.task.number}" if report.task is not None else ""
    doing = {m.Doing.WORKING: "works"}.get(report.doing, report.doing.value)
    battery = f", battery {report.battery_v:g} V" if report.battery_v is not None else ""
    return f"{doing}{task}{battery}"
