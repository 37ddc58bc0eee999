"""The pieces of the terminal view, as rich's renderables: the conversation, the task board, the map, the summary."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table
from rich.text import Text

from hvcpd.reporting.events import Garbled, Heard, Performed, Plant, Skill, Started, Summary
from hvcpd.reporting.icons import character
from hvcpd.reporting.palette import ROBOT_TERMINAL, task_style
from hvcpd.reporting.story import Line, all_went_well, outcome
from hvcpd.reporting.text import (
    at_least,
    clean,
    clock,
    if_known,
    listed,
    plural,
    seal_words,
    skill_words,
    task_words,
    without_common_start,
)
from hvcpd.reporting.watching import BoardRow, GaveUp, Note, Watch

_ASCII = str.maketrans({"×": "x", "–": "-", "…": "~", "·": ".", "✓": "+", "≠": "!"})
SHOWN_LISTENERS = 4
"""More are counted, not named: a line stays a line with twelve robots."""
MAP_COLUMNS_PER_ROW = 2
"""A terminal's cell is about twice as high as it is wide."""


class Artist:
    """Turns what is watched into text for one console: its colours, and its characters if it knows only ASCII."""

    def __init__(self, console: Console, watch: Watch) -> None:
        self._ascii = console.options.ascii_only
        self.watch = watch
        self._robots = watch.started.robots
        self._styles = {name: ROBOT_TERMINAL[k % len(ROBOT_TERMINAL)] for k, name in enumerate(self._robots)}

    def plain(self, text: str) -> str:
        """Any text from outside, fit for this console."""
        text = clean(text)
        return text.translate(_ASCII).encode("ascii", "replace").decode("ascii") if self._ascii else text

    def style(self, robot: str) -> str:
        return self._styles.get(robot, "white")

    def mark(self, icon: str) -> str:
        """A task's mark, one column wide."""
        return "*" if self._ascii else character(icon)

    def text(self, *parts: str | tuple[str, str]) -> Text:
        """Parts, each a string or (string, style); never read as markup."""
        text = Text(overflow="crop" if self._ascii else "ellipsis")
        for part in parts:
            string, style = (part, "") if isinstance(part, str) else part
            text.append(self.plain(string), style)
        return text

    def deed(self, at_s: float, robot: str, *parts: str | tuple[str, str]) -> Text:
        """A line of a robot's: the time, its name, and what it did."""
        return self.text((f"{clock(at_s):>5}  ", "dim"), (robot, self.style(robot)), *parts)

    def utterance(self, line: Line, final: bool) -> list[Text]:
        """What was said, with the time when it was over, and below it its hearers."""
        who = (line.said.speaker, f"bold {self.style(line.said.speaker)}")
        first = self.text((f"{clock(line.said.end_s):>5}  ", "dim"), who, ": ", line.said.text)
        hearers = self.text(" · ").join(map(self.text, self.hearers(line, final)))
        return [first, self.text("       ").append_text(hearers)]

    def task(self, number: int) -> str:
        """A task in words: its name and number."""
        return task_words(number, self.watch.names.get(number))

    def hearers(self, line: Line, final: bool) -> list[tuple[str, str]]:
        """The robots that heard an utterance, with their confidence, and those that did not."""
        right = [h for h in line.heard if h.text == line.said.text]
        parts: list[tuple[str, str]] = []
        if line.said.collided:
            parts.append(("collided", "bold red"))
        if right:
            named = listed(h.listener + if_known(h.confidence, " {}") for h in right)
            if len(right) > SHOWN_LISTENERS:
                named = f"{len(right)} of {len(self._robots) - 1}"
                named += at_least((h.confidence for h in right), ", {}")
            parts.append((f"heard by {named}", "green"))
        if right and right[0].seal and right[0].seal != "not trusted":
            parts.append((seal_words(right[0].seal), "green"))
        parts += [(f"{h.listener} understood: {h.text}", "yellow") for h in line.heard if h not in right]
        doubting = tuple(h.listener for h in line.heard if h.seal == "not trusted")
        if doubting:
            parts.append((f"not trusted by {_named(doubting)}", "bold yellow"))
        if line.garbled:
            parts.append((f"garbled at {_named(line.garbled)}", "red"))
        if line.missed and final:
            parts.append((f"not heard by {_named(line.missed)}", "red"))
        if not parts and len(self._robots) == 1:
            return [("nobody else is here", "dim")]
        return parts or [("listening …", "dim")]


def _named(names: tuple[str, ...]) -> str:
    return listed(names) if len(names) <= SHOWN_LISTENERS else plural(len(names), "robot")


def note_lines(artist: Artist, note: Note) -> list[Text]:
    """A note as one line and, for an utterance, a second with its hearers."""
    match note:
        case Line():
            return artist.utterance(note, final=True)
        case Heard():
            heard = f" heard a voice that is no robot's{if_known(note.confidence, ' ({})')}: "
            return [artist.deed(note.at_s, note.listener, heard, note.text)]
        case Garbled():
            heard = " heard speech, from no robot, that it could not understand"
            return [artist.deed(note.at_s, note.listener, heard)]
        case Performed():
            return [_performed(artist, note)]
        case Skill():
            used = (f": {skill_words(vars(note))}", "" if note.state == "finished" else "bold red")
            return [artist.deed(note.at_s, note.robot, used)]
        case GaveUp():
            return [artist.deed(note.at_s, note.robot, f" gives up {artist.task(note.task)}")]


def _performed(artist: Artist, note: Performed) -> Text:
    watch = artist.watch
    plant: Plant | None = next((p for p in watch.started.plants if p.task == note.task), None)
    name, icon = watch.names.get(note.task, ""), watch.icons.get(note.task, "")
    did, count = " has done its part of", ""
    if not watch.is_part(note):
        nth = 1 + list(watch.performed).index(note.task)  # by now more may have been done
        did, count = " has done", f": {nth} of {watch.wanted}"
    away = f", {1000 * math.hypot(note.x_m - plant.x_m, note.y_m - plant.y_m):.0f} mm off" if plant else ""
    return artist.text(
        (f"{clock(note.at_s):>5}  ", "dim"),
        (f"{artist.mark(icon)} ", task_style(name)),
        (note.robot, f"bold {artist.style(note.robot)}"),
        (f"{did} {artist.task(note.task)}{away}{count}", "bold"),
    )


def under_way(artist: Artist) -> list[Text]:
    """The last two utterances that not everybody has accounted for yet."""
    pending = (artist.watch.line(said) for said in artist.watch.pending[-2:])
    return [text for line in pending for text in artist.utterance(line, final=False)]


_STATES = {"open": "dim", "claimed": "yellow", "done": "green"}


def task_board(artist: Artist, rows: int) -> Table:
    """The tasks in at most `rows` lines, the unfinished first where there is no room for all."""
    board = artist.watch.board()
    shorts = without_common_start([clean(row.name) for row in board])
    names = dict(zip((row.task for row in board), shorts, strict=True))
    hidden = 0
    if len(board) > rows:
        board.sort(key=lambda row: (row.state == "done", row.state != "claimed", row.task))
        hidden = len(board) - max(rows - 1, 0)
        board = board[: max(rows - 1, 0)]
    table = Table.grid(padding=(0, 1), expand=True)
    table.add_column(justify="right", no_wrap=True, width=2)
    table.add_column(no_wrap=True, ratio=3)
    table.add_column(no_wrap=True, width=7)
    table.add_column(no_wrap=True, ratio=2)
    for row in board:
        state = artist.text((row.state, _STATES.get(row.state, "")))
        task = artist.text((names[row.task], task_style(row.name)))
        table.add_row(artist.text((str(row.task), "dim")), task, state, _who(artist, row))
    if hidden:
        table.add_row("", artist.text((f"… and {hidden} more", "dim")), "", "")
    return table


def _who(artist: Artist, row: BoardRow) -> Text:
    text = artist.text((row.owner, artist.style(row.owner)) if row.owner else "")
    believed: dict[str, list[str]] = {}
    for name, (state, owner) in row.differing:
        other = f" by {owner}" if owner not in (None, row.owner) else ""
        believed.setdefault(f"{state}{other}", []).append(name)
    for belief, names in believed.items():
        who = names[0] if len(names) == 1 else plural(len(names), "robot")
        text.append_text(artist.text((f" {who}: {belief}", "dim")))
    return text


@dataclass(frozen=True)
class FloorPlan:
    """The room from above in characters: a column is `metres / 2` wide, a row `metres` high."""

    left_m: float
    top_m: float
    metres: float
    columns: int
    rows: int

    def cell(self, x_m: float, y_m: float) -> tuple[int, int] | None:
        """Column and row of a point; None outside."""
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            return None
        column = round((x_m - self.left_m) / self.metres * MAP_COLUMNS_PER_ROW)
        row = round((self.top_m - y_m) / self.metres)
        return (column, row) if 0 <= column < self.columns and 0 <= row < self.rows else None


def floor_plan(started: Started, columns: int, rows: int) -> FloorPlan | None:
    """Tasks' places and the starts fitted into `columns` × `rows` characters; None if there is nothing or no room."""
    points = [(plant.x_m, plant.y_m) for plant in started.plants]
    points += [(pose.x_m, pose.y_m) for pose in started.starts]
    points = [p for p in points if all(map(math.isfinite, p))]
    if not points or columns < 12 or rows < 4:
        return None
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    wide, high = max(xs) - min(xs) + 1.0, max(ys) - min(ys) + 1.0
    metres = max(wide * MAP_COLUMNS_PER_ROW / (columns - 1), high / (rows - 1), 0.25)
    used = min(columns, math.ceil(wide / metres * MAP_COLUMNS_PER_ROW) + 1), min(rows, math.ceil(high / metres) + 1)
    return FloorPlan(min(xs) - 0.5, max(ys) + 0.5, metres, *used)


def draw_map(artist: Artist, plan: FloorPlan, visited: dict[tuple[int, int], str]) -> list[Text]:
    """Trails as dots, tasks as their number (their mark when done), robots by their initial."""
    watch = artist.watch
    cells = {cell: ("·", artist.style(robot)) for cell, robot in visited.items()}
    for plant in watch.started.plants:
        cell = plan.cell(plant.x_m, plant.y_m)
        if cell:
            mark = str(plant.task)[-1:]
            if plant.task in watch.performed:
                mark = artist.mark(watch.icons.get(plant.task, ""))
            cells[cell] = (mark, f"bold {task_style(plant.name)}")
    for robot, pose in zip(watch.started.robots, watch.poses, strict=False):
        cell = plan.cell(pose.x_m, pose.y_m)
        if cell:
            cells[cell] = (clean(robot)[:1] or "?", f"bold reverse {artist.style(robot)}")
    blank = (" ", "")
    return [artist.text(*(cells.get((c, r), blank) for c in range(plan.columns))) for r in range(plan.rows)]


def conclusion(artist: Artist, summary: Summary) -> Iterable[Text]:
    """The result, in a few lines."""
    watch, ended = artist.watch, outcome(summary)
    if all_went_well(summary):
        yield artist.text((f"✓ {ended}", "bold green"))
    else:
        yield artist.text((f"Not everything went well: {ended[0].lower()}{ended[1:]}", "bold red"))
        yield from _not_done(artist, summary)
    doing = (robot for robots in watch.doers.values() for robot in robots)
    for robot in dict.fromkeys([*watch.started.robots, *doing]):
        times = {watch.names[number]: doers.count(robot) for number, doers in sorted(watch.doers.items())}
        own = [name + f" ({count} times)" * (count > 1) for name, count in times.items() if count]
        named = listed(own) if own else "nothing"
        yield artist.text("  ", (robot, f"bold {artist.style(robot)}"), f": {named}")
    rate = f"{summary.realtime_factor:.0f} times faster than real time"
    if summary.realtime_factor < 1.5:
        rate = "in real time" if summary.realtime_factor > 0.9 else "slower than real time"
    sent = plural(summary.utterances_sent, "utterance")
    if len(watch.started.robots) > 1:
        understood = f"{summary.utterances_understood} of {sent} understood"
        yield artist.text(f"  {understood}, {plural(summary.collisions, 'collision')}")
    else:
        yield artist.text(f"  {sent}, with no other robot to hear them")
    mission = f"{clock(summary.virtual_s)} of mission time in {summary.wall_s:.1f} s"
    yield artist.text(f"  {mission}: {rate} (seed {summary.seed})")


def _not_done(artist: Artist, summary: Summary) -> Iterable[Text]:
    """The tasks that were not carried out, with the reason for which a skill failed last, if one did."""
    for number in summary.undone:
        reason = artist.watch.failures.get(number, "")
        because = f" ({reason})" if reason else ""
        how = "  half done" if number in artist.watch.doers else "  not done"
        yield artist.text((how, "bold red"), f": {artist.task(number)}{because}")
