"""The mission on a terminal while it is going on; where there is no terminal, plain lines."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

from hvcpd.reporting.events import Event, Moved, Started
from hvcpd.reporting.live_parts import Artist, conclusion, draw_map, floor_plan, note_lines, task_board, under_way
from hvcpd.reporting.story import Line
from hvcpd.reporting.text import clock
from hvcpd.reporting.watching import Note, Watch

FRAME_S = 0.2
"""Wall time between two pictures: one takes about 5 ms for two robots and 20 ms for twelve with forty tasks."""
MAP_COLUMNS = 30
MAP_MAX_ROWS = 15
MAP_MIN_WIDTH = 76
"""Narrower terminals get the task board alone: it needs about 44 columns beside the map."""
MAP_MIN_HEIGHT = 20
OTHER_ROWS = 9
"""Rows of the picture beside the board: two utterances of two lines, rules, the progress bar, the prompt."""
BAR_WIDTH = 24
INDENT = 7
"""Columns of the time and the gap after it: what goes on on another line begins below the words."""


class LiveView:
    """Shows a mission's events: a context manager; give it every event after `started` in order.

    The conversation scrolls by and stays; below it stand the task board, a small map and the progress until the end.
    `monotonic_s` tells the time on the wall, s, which limits how often the picture is drawn.
    """

    def __init__(self, console: Console, started: Started, monotonic_s: Callable[[], float] = time.monotonic) -> None:
        self._console = console
        self._watch = Watch(started)
        self._artist = Artist(console, self._watch)
        self._monotonic_s = monotonic_s
        self._began_s = monotonic_s()
        self._drawn_s = -FRAME_S
        self._visited: dict[tuple[int, int], str] = {}
        self._plan = floor_plan(started, MAP_COLUMNS, min(max(len(self._watch.names), 9), MAP_MAX_ROWS))
        self._live: Live | None = None
        if console.is_terminal and not console.is_dumb_terminal:
            self._live = Live(console=console, auto_refresh=False, transient=True)

    def __enter__(self) -> LiveView:
        started = self._watch.started
        noise = f"{started.noise_db_spl:.0f} dB of noise"
        who = f"{', '.join(started.robots)} in {started.mode} mode, seed {started.seed}, {noise}"
        self._print(self._artist.text((who, "dim")))
        if self._live is not None:
            self._live.start()
            self._live.update(self.picture(), refresh=True)
        return self

    def __exit__(self, *exception: object) -> None:
        if self._live is not None:
            self._live.stop()
        for note in self._watch.settle(everything=True):
            self._tell(note)
        summary = self._watch.summary
        if summary is not None:
            self._print(Text(""))
            for line in conclusion(self._artist, summary):
                self._print(line)

    def handle(self, event: Event) -> None:
        """Take one event in and show what it changes."""
        for note in self._take(event):
            self._tell(note)
        now_s = self._monotonic_s()
        if self._live is not None and now_s - self._drawn_s >= FRAME_S:
            self._drawn_s = now_s
            self._live.update(self.picture(), refresh=True)

    def lines(self, event: Event) -> list[Text]:
        """Take one event in; the lines that it adds to the conversation, for whoever shows them elsewhere."""
        return self._wrapped(line for note in self._take(event) for line in note_lines(self._artist, note))

    def _take(self, event: Event) -> list[Note]:
        if isinstance(event, Moved):
            self._draw_trail(event)
        return self._watch.handle(event)

    def _tell(self, note: Note) -> None:
        lines = note_lines(self._artist, note)
        if self._live is None and isinstance(note, Line):  # one line an event, so that grep finds all of it
            first, second = lines
            lines = [Text.assemble(first, "  [", second.plain.strip(), "]")]
        self._print(*lines)

    def _print(self, *lines: Text) -> None:
        """To a terminal wrapped, to a file as they are."""
        if self._live is None:
            for line in lines:
                self._console.print(line, soft_wrap=True, highlight=False)
            return
        # all lines at once: each print draws the picture again
        self._console.print(Group(*self._wrapped(lines)), highlight=False)

    def _wrapped(self, lines: Iterable[Text]) -> list[Text]:
        """Broken at the terminal's width, with the rest indented."""
        width = self._console.width
        indent = INDENT if width >= 4 * INDENT else 0
        parts: list[Text] = []
        for line in lines:
            line.overflow = "fold"
            wrapped = line.wrap(self._console, max(width - indent, 1))
            parts += [Text(" " * indent * (k > 0)).append_text(part) for k, part in enumerate(wrapped)]
        return parts

    def _draw_trail(self, event: Moved) -> None:
        if self._plan is None:
            return
        for robot, pose in zip(self._watch.started.robots, event.poses, strict=False):
            cell = self._plan.cell(pose.x_m, pose.y_m)
            if cell is not None:
                self._visited[cell] = robot

    def picture(self) -> RenderableType:
        """What stands below the conversation: who speaks, the board, the map and the progress."""
        width, height = self._console.width, self._console.height
        rows = max(min(len(self._watch.names), height - OTHER_ROWS), 1)
        board: RenderableType = task_board(self._artist, rows)
        plan = self._plan
        if plan is not None and width >= MAP_MIN_WIDTH and height >= max(MAP_MIN_HEIGHT, plan.rows + OTHER_ROWS):
            beside = Table.grid(padding=(0, 2), expand=True)
            beside.add_column(ratio=1)
            beside.add_column(width=plan.columns, no_wrap=True)
            beside.add_row(board, Group(*draw_map(self._artist, plan, self._visited)))
            board = beside
        lines = under_way(self._artist)
        for line in lines:
            line.no_wrap = True
        return Group(*lines, self._rule(), board, self._rule(), self._progress(width))

    def _rule(self) -> Rule:
        return Rule(style="dim", characters="-" if self._console.options.ascii_only else "─")

    def _progress(self, width: int) -> RenderableType:
        watch = self._watch
        done, total = len(watch.performed), watch.wanted
        passed_s = self._monotonic_s() - self._began_s
        text = f"{done} of {total} done · {clock(watch.now_s)} of mission time"
        if passed_s > 1.0:
            text += f" · {watch.now_s / passed_s:.0f} × real time"
        row = Table.grid(padding=(0, 1))
        row.add_column(width=min(BAR_WIDTH, max(width - 30, 4)))
        row.add_column(no_wrap=True)
        words = self._artist.text(text)
        words.no_wrap = True
        row.add_row(ProgressBar(total=max(total, 1), completed=done, width=None), words)
        return row
