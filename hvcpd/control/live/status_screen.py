"""The output of `hvcpctl status` and `hvcpctl tasks` for people, from the daemon's JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.console import Group, JustifyMethod, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from hvcpd.ports import WARN_BATTERY_V
from hvcpd.reporting.text import clean, number, plural, shown_away, skill_words, task_words

_STATE_STYLES = {"done": "green", "claimed": "yellow"}


def status_screen(status: Mapping[str, Any]) -> RenderableType:
    """The whole status: who, what it is doing, its body, and who is within earshot."""
    head = Table.grid(expand=True)
    head.add_column(ratio=1)
    head.add_column(justify="right", no_wrap=True)
    who = Text.assemble((clean(status["name"]), "bold"), f"  team {clean(status['team'])}, {clean(status['mode'])}")
    head.add_row(who, Text(f"hvcpd {status['version']}, up {duration(status['uptime_s'])}", "dim"))
    facts = Table.grid(padding=(0, 2))
    facts.add_column(style="dim", no_wrap=True)
    facts.add_column()
    for label, value in _facts(status):
        facts.add_row(label, value)
    parts: list[RenderableType] = [head, Padding(facts, (0, 0, 0, 2))]
    if status["stopped"]:
        pressed = "its stop button is pressed, or the wire is broken: nothing releases it meanwhile; then it "
        held = pressed if status.get("button_pressed") else ""
        parts.insert(1, Text(f'STOPPED: {held}stands until somebody says "resume", or hvcpctl resume', "bold red"))
    parts.append(Padding(_peers(status["peers"]), (1, 0, 0, 2)))
    return Group(*parts)


def _facts(status: Mapping[str, Any]) -> list[tuple[str, RenderableType]]:
    doing = clean(status["doing"])
    if status["task"] is not None:
        doing += f": {task_words(status['task']['number'], status['task']['name'])}"
    if status["speaking"]:
        doing += " (speaking)"
    if status.get("preparing") is not None:  # a daemon before this field says nothing of it
        doing += f"; {clean(status['preparing'])}"
    facts: list[tuple[str, RenderableType]] = [("Doing", doing), ("Tasks", _counts(status["tasks"]))]
    pose = status["pose"]
    if pose is not None and status["wheels"] is not None:
        where = f"x {number(pose['x_m'])} m, y {number(pose['y_m'])} m, heading {number(pose['heading_deg'], 0)}°"
        facts.append(("Place", where))
    facts.append(("Wheels", _wheels(status["wheels"])))
    if status["wheels"] is not None:
        facts.append(("Battery", _battery(status)))
    facts.append(("Sound", _sound(status["sound"])))
    facts += _talk(status.get("talk"))  # a daemon before this field says nothing of it
    facts += _skills(status.get("skills"))  # a daemon before this field says nothing of it
    facts += [("Way", _way(place)) for place in status.get("places", ())]
    facts += [("Memory", Text(clean(fault), "bold red")) for fault in memory_faults(status["memory"])]
    return facts


def _talk(talk: Mapping[str, Any] | None) -> Iterator[tuple[str, RenderableType]]:
    """How much the robot says, unless that is as usual."""
    if talk is None or (talk["now"] == "normal" and talk["quiet"] is None):
        return
    softer = f", {-talk['level_db']:g} dB softer" if talk["level_db"] else ""
    hours = f" (quiet hours {clean(talk['quiet'])})" if talk["quiet"] is not None else ""
    yield "Talk", f"{clean(talk['now'])}{softer}{hours}"


def memory_faults(memory: Mapping[str, Any]) -> Iterator[str]:
    """The faults of a memory in `status`, the worst first; older daemons report only `lost`."""
    if memory.get("unkept"):
        yield memory["unkept"]
    fault, loss = memory.get("fault"), memory.get("loss")
    if fault:
        yield f"nothing is kept{', nor known from before this start' * (fault == loss)}: {fault}"
    if loss and loss != fault:
        yield f"lost, or not certain, from before this start: {loss}"
    if memory["lost"]:
        yield f"{plural(memory['lost'], 'record')} not kept; see the log for the reason"


def _counts(tasks: Mapping[str, int]) -> str:
    order = ("open", "claimed", "done", "left_out")
    return ", ".join(f"{tasks[state]} {state.replace('_', ' ')}" for state in order if tasks.get(state)) or "none"


def _wheels(wheels: Mapping[str, Any] | None) -> RenderableType:
    if wheels is None:
        return "none: the robot stands and talks"
    if wheels["fault"] is not None:
        return Text(f"failed: {clean(wheels['fault'])}", "bold red")
    if not wheels.get("open", True):
        return "not opened yet"
    return "turning" if wheels["turning"] else "standing"


def _battery(status: Mapping[str, Any]) -> RenderableType:
    voltage_v = status["battery_v"]
    if voltage_v is None:
        return Text("not measured", "dim")
    low = voltage_v < WARN_BATTERY_V
    return Text(f"{voltage_v:.1f} V" + (", charge it" if low else ""), "bold red" if low else "")


def _sound(sound: Mapping[str, Any]) -> RenderableType:
    if not sound["listening"]:
        return Text("not listening" + (": the microphone is mute" if sound.get("mute") else ""), "bold red")
    if sound.get("mute"):  # a daemon before this field says nothing of it
        return Text("the microphone is mute: it gives nothing but zeros", "bold red")
    if sound.get("too_busy"):
        return Text("lost or late: the computer is too busy; end other programs", "bold red")
    told = Text(f"{sound['level_dbfs']:.0f} dBFS now, {sound['floor_dbfs']:.0f} dBFS at the quietest; ")
    lost = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in sound["lost"].items() if count)
    return told.append(f"lost: {lost}", "yellow") if lost else told.append("nothing lost")


def _skills(skills: Mapping[str, Any] | None) -> Iterator[tuple[str, RenderableType]]:
    """The skills offered, missing and under way; empty if tasks use no skill."""
    if not skills:
        return
    if skills["offered"]:
        yield "Skills", ", ".join(map(clean, skills["offered"]))
    if skills["missing"]:
        told = ", ".join(map(clean, skills["missing"]))
        yield "Skills", Text(f"nobody offers {told}: start `hvcpctl skills`, or leave it to others", "yellow")
    if skills["call"] is not None:
        yield "Uses", clean(skill_words(skills["call"]))


def _way(place: Mapping[str, Any]) -> str:
    """The robot that has a shared place, or had it last, and the robots that wait for it."""
    keeper, waiting = place["keeper"], [clean(name) for name in place["waiting"]]
    has = "had it last" if place["lease_s"] == 0 else "has it"
    has = f"{clean(keeper)} {has}" if keeper is not None else "nobody has it"
    here = ", in it now" if place["inside"] else ", waited for" if place["wanted_s"] is not None else ""
    return f"{clean(place['name'])}: {has}{here}" + (f"; waiting: {', '.join(waiting)}" if waiting else "")


def _peers(peers: Sequence[Mapping[str, Any]]) -> RenderableType:
    if not peers:
        return Text("No other robot was heard so far", "dim")
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim", pad_edge=False)
    for title in ("Heard", "Team", "Last", "Sure", "SNR", "Away"):  # in a narrow terminal no digit may be lost
        justify: JustifyMethod = "left" if title in ("Heard", "Team") else "right"
        table.add_column(title, justify=justify, overflow="fold", no_wrap=title in ("Sure", "SNR", "Away"))
    for peer in sorted(peers, key=lambda peer: float(peer["heard_ago_s"])):
        snr = f"{peer['snr_db']:.0f} dB" if peer["snr_db"] is not None else "–"
        far = shown_away(peer) or "–"
        team, ago = clean(peer["team"] or "–"), f"{duration(peer['heard_ago_s'])} ago"
        style = "" if peer["present"] else "dim"
        table.add_row(clean(peer["name"]), team, ago, f"{peer['confidence']:.0%}", snr, far, style=style)
    return table


def tasks_screen(tasks: Sequence[Mapping[str, Any]]) -> RenderableType:
    """The board as a table."""
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim", pad_edge=False)
    for title in ("No", "Task", "State", "By", ""):
        table.add_column(
            title, justify="right" if title == "No" else "left", overflow="fold", no_wrap=title in ("No", "State", "By")
        )
    for task in tasks:
        state = Text(task["state"], _STATE_STYLES.get(task["state"], ""))
        table.add_row(str(task["number"]), clean(task["name"]), state, clean(task["owner"] or "–"), _remark(task))
    return table


def _remark(task: Mapping[str, Any]) -> str:
    remarks = []
    if task["hearsay"]:
        remarks.append("by hearsay")
    if task.get("left_out"):
        remarks.append("left out: nobody has done it")
    if task["lease_s"] is not None:
        remarks.append(f"claim holds for {duration(task['lease_s'])}" if task["lease_s"] > 0 else "claim has lapsed")
    if task["failed_by"]:
        remarks.append(f"given up by {', '.join(map(clean, task['failed_by']))}")
    if task.get("every"):
        remarks.append(f"every {clean(task['every'])}" if task["every"][:1].isdigit() else clean(task["every"]))
    if task["unable"]:
        remarks.append("not for this robot")
    return "; ".join(remarks)


def duration(seconds: float) -> str:
    """A length of time as people say it, in its largest unit and the next: 3 h 12 min."""
    whole = max(round(seconds), 0)
    units = (("d", 86400), ("h", 3600), ("min", 60), ("s", 1))
    first = next((index for index, (_, length) in enumerate(units) if whole >= length), len(units) - 1)
    parts: list[str] = []
    for unit, length in units[first : first + 2]:
        count, whole = divmod(whole, length)
        if count or not parts:
            parts.append(f"{count} {unit}")
    return " ".join(parts)
