"""What a duet writes at its beginning."""

from __future__ import annotations

import shlex
from pathlib import Path

from hvcpd.config.settings import DEFAULT_NAMES
from hvcpd.daemon.control_socket import socket_path
from hvcpd.daemon.wiring import Wiring
from hvcpd.reporting.text import listed, task_words

_READY = """\
Ready: {first} begins in a moment.{partner}
{join}:  {last}, stop  ·  {last}, resume  ·  what is left  ·  {one}, what are you doing
More to try: hvcpctl phrases, and docs/duet.md. Ctrl-C ends it.
"""


def welcome_text(robots: tuple[str, ...], where: str, address: str, socket: Path) -> str:
    """The first lines for the terminal; `address` is the console's, "" without one, `socket` the first robot's."""
    talk, prepare = ("talks", "It prepares its") if len(robots) == 1 else ("talk", "They prepare their")
    watch = f"Watch {robots[0]} at {address}\n" if address else ""
    ask = f"Ask {robots[0]} from another terminal: hvcpctl status --socket {shlex.quote(str(socket))}\n"
    return f"{listed(robots)} {talk} {where}.\n{watch}{ask}{prepare} words …\n"


def partner_command(names: tuple[str, ...], here: tuple[str, ...], config: Path | None, tasks: Path | None) -> str:
    """The command by which the first of the `names` that does not run here starts on another computer; "" if all do."""
    others = [name for name in names if name not in here]
    if not others:
        return ""
    given = {"--config": config, "--tasks": tasks, "--names": ",".join(names)}
    if set(names) == set(DEFAULT_NAMES):
        del given["--names"]
    options = [word for option, value in given.items() if value is not None for word in (option, str(value))]
    return shlex.join(["hvcpctl", "duet", *options, "--as", others[0]])


def ready_text(robots: tuple[str, ...], partner: str, by_voice: bool) -> str:
    """The text for the terminal when all robots here listen; `partner` is the command of one on another computer, ""
    without one; `by_voice`: to a microphone, too."""
    first = robots[0] if len(robots) == 1 else "one of them"
    partner = f" Its partner runs on another computer within earshot: {partner}" if partner else ""
    join = "Say, or type and press Enter" if by_voice else "Type and press Enter"
    return _READY.format(first=first, partner=partner, join=join, one=robots[0], last=robots[-1])


def lacking_text(wiring: Wiring, config: Path | None) -> str:
    """The tasks that no robot does before a program offers it their skills, and how; "" if there are none. `config`:
    the settings file."""
    numbers = wiring.tasks.lacking(name for name, skill in wiring.settings.skills.items() if skill.joint is not None)
    if not numbers:
        return ""
    tasks = listed(task_words(task.number, task.name) for task in wiring.tasks.tasks if task.number in numbers)
    command = ["hvcpctl", "skills", *(("--config", str(config)) if config is not None else ())]
    how = shlex.join([*command, "--socket", str(socket_path(wiring.settings))])
    return f"Nobody does {tasks} until each robot is offered the skills, {wiring.settings.name} by: {how}\n"
