"""The lines and the live picture of `hvcpctl follow`."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.rule import Rule
from rich.text import Text

from hvcpd.console.lines import SURE, SpeakerColours, is_passing
from hvcpd.control.live.status_screen import memory_faults, status_screen, tasks_screen
from hvcpd.reporting.palette import ROBOT_TERMINAL
from hvcpd.reporting.text import clean, how_sure, seal_words, skill_words, task_words

Event = dict[str, Any]
Parts = list[Any]
"""The arguments of `Text.assemble`."""


class FollowLines:
    """Prints a line for each event; on a terminal also the present state and board below them."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None
        self._colours = SpeakerColours()
        self._tasks: dict[int, str] = {}

    def __enter__(self) -> FollowLines:
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False)
            self._live.start()
        return self

    def __exit__(self, *exception: object) -> None:
        if self._live is not None:
            self._live.stop()

    def event(self, event: Event, wall_s: float) -> None:
        """Print the event's line, if it has one."""
        line = self.line(event, wall_s)
        if line is not None:
            self._console.print(line, soft_wrap=not self._console.is_terminal)

    def state(self, status: Event, tasks: list[Event]) -> None:
        """Take the state and the board; draw them on a terminal."""
        self._tasks = {task["number"]: task["name"] for task in tasks}
        self._style(status["name"])
        if self._live is None:
            return
        self._live.update(Group(Rule(style="dim"), status_screen(status), tasks_screen(tasks)), refresh=True)

    def note(self, text: str) -> None:
        """Print a message about the connection."""
        self._console.print(Text(text, "bold yellow"), soft_wrap=not self._console.is_terminal)

    def line(self, event: Event, wall_s: float) -> Text | None:
        """The event as a line; None for what the picture shows better."""
        told = self._told(event) if not is_passing(event) else None
        if told is None:
            return None
        at = datetime.fromtimestamp(wall_s).strftime("%H:%M:%S")
        return Text.assemble((at, "dim"), "  ", *told)

    def _told(self, event: Event) -> Parts | None:
        match "stopped" if event.get("state") == "stopped" else event.get("event"):
            case "said":
                return [*self.speech(event), *_seal(event)]
            case "heard":
                sure = (event["confidence"] or 0.0) >= SURE
                how = f"  {how_sure(event['confidence'], event['snr_db'])}"
                return [*self.speech(event), (how, "dim" if sure else "yellow"), *_seal(event)]
            case "garbled":
                return [("somebody spoke and was not understood", "yellow")]
            case "held":
                length_s = event["until_s"] - event["at_s"]
                return [(f'stood still for {length_s:.1f} s for what sounded like "stop"', "yellow")]
            case "noted":
                return [(clean(event["text"]), "bold yellow")]
            case "performed":
                return [(f"{event['robot']} has carried out {self.task(event['task'])}", "green")]
            case "taskchanged":
                owner = f" by {event['owner']}" if event["owner"] else ""
                return [(f"{self.task(event['task'])}: {event['state']}{owner}", "dim")]
            case "stopped":
                return [("stopped: stands until it is told to resume", "bold red")]
            case "memory":
                faults = "; ".join(map(clean, memory_faults({**event, "lost": 0})))
                return [(f"memory: {faults}", "bold red") if faults else ("memory works again", "green")]
            case "skill":
                style = {"failed": "bold red", "finished": "green"}.get(event["state"], "dim")
                return [(clean(f"{event['robot']} uses {skill_words(event)}"), style)]
            case _:
                return None

    def speech(self, event: Event) -> Parts:
        """The speaker and the sentence."""
        speaker = clean(event["speaker"])
        return [(speaker, f"bold {self._style(speaker)}"), ": ", clean(event["text"])]

    def task(self, number: int) -> str:
        """The text for a task."""
        return task_words(number, self._tasks.get(number))

    def _style(self, name: str) -> str:
        return ROBOT_TERMINAL[self._colours.of(name)]


def _seal(event: Event) -> Parts:
    """What is known about the sentence's seal, if there is a key."""
    seal = clean(event.get("seal", ""))
    return [(f"  {seal_words(seal)}", "bold yellow" if seal == "not trusted" else "green")] if seal else []
