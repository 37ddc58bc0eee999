"""The command line of what is asked of a running daemon; light, since every command builds the whole parser."""

from __future__ import annotations

import argparse
from pathlib import Path

from hvcpd.control.arguments import (
    Commands,
    add_command,
    add_config,
    add_json,
    add_memory,
    add_tasks,
    file_in,
    place,
    port,
    robot_name,
    task_number,
    task_numbers,
    whole,
)

EXITS = (
    "Exit status: 0 done, 1 not done (the daemon says why), 2 bad input, 3 no daemon runs, 4 no permission to ask it, "
    "130 interrupted."
)
_WHICH = "Without --name: the robot named in the settings, or the only one that runs on this computer. "


def add_daemon_commands(commands: Commands) -> None:
    """Add the commands that ask a running daemon, read its memory, or connect it with other programs."""
    _add_views(commands)
    _add_console(commands)
    _add_orders(commands)
    _add_task(commands)
    _add_config(commands)
    _add_memory_commands(commands)
    _add_ros(commands)
    text = "carry out a robot's skills (programs, pins, Python objects), until interrupted"
    examples = ("hvcpctl skills --config greenhouse.yaml", "hvcpctl skills --check")
    skills = add_command(commands, "skills", text, "live.skills", *examples, epilog=_WHICH + EXITS)
    _add_which(skills)
    skills.add_argument("--check", action="store_true", help="only check that everything needed is there")
    _add_mqtt(commands)
    _add_mcap(commands)


def _add_views(commands: Commands) -> None:
    """`status`, `tasks` and `follow`."""
    text = "show what a running robot is doing"
    status = _add(commands, "status", text, "live.status", "hvcpctl status --watch")
    _add_watch(status)
    metrics = "print it once as metrics, for the textfile collector"
    status.add_argument("--prometheus", action="store_true", help=metrics)
    text = "list the tasks, and which are open, claimed or done"
    tasks = _add(commands, "tasks", text, "live.status", "hvcpctl tasks", "hvcpctl tasks --json")
    _add_watch(tasks)
    tasks.set_defaults(prometheus=False)
    examples = ("hvcpctl follow", "hvcpctl follow --json --poses > shift.jsonl     # for `hvcpctl mcap`")
    text = "show what a robot says, hears and does, as it happens"
    follow = _add(commands, "follow", text, "live.follow", *examples)
    follow.add_argument("--poses", action="store_true", help="with --json: also where it is, four times a second")
    follow.add_argument(
        "--sound", action="store_true", help="with --json: also what it hears, if `control.sound` is true"
    )


def _add_orders(commands: Commands) -> None:
    """`stop`, `resume`, `reload` and `range`."""
    short = "live.short_commands"
    text = "halt a robot, or all that run here, at once, until told to resume"
    everybody = "Without --name, --socket and --config: every robot that runs on this computer. "
    _add(commands, "stop", text, short, "hvcpctl stop", "hvcpctl stop --name Rob", which=everybody)
    _add(commands, "resume", "let a stopped robot take on tasks again", short, "hvcpctl resume")
    _add(commands, "reload", "make a robot read its settings and tasks again", short, "hvcpctl reload")
    text = "measure the distance from a running robot to another one, by sound"
    measure = _add(commands, "range", text, "live.range", "hvcpctl range Bot --name Rob")
    measure.add_argument("robot", metavar="ROBOT", help="the other robot; both must stand")


def _add_config(commands: Commands) -> None:
    text, examples = (
        "show each setting and where it comes from",
        ("hvcpctl config", "hvcpctl config --example > hvcpd.yaml"),
    )
    config = _add(commands, "config", text, "live.show_config", *examples)
    config.add_argument("--running", action="store_true", help="settings of the running daemon, not of the next one")
    config.add_argument("--example", action="store_true", help="print a commented settings file to start from")
    config.add_argument("--changed", action="store_true", help="only settings that differ from the default")


def _add_memory_commands(commands: Commands) -> None:
    """`transcript` and `report`."""
    examples = ("hvcpctl transcript", "hvcpctl transcript --since 1h")
    transcript = add_command(commands, "transcript", "print what a robot said and heard", "live.transcript", *examples)
    add_memory(transcript)
    transcript.add_argument("--follow", action="store_true", help="go on with new sentences, until interrupted")
    text = "describe a shift: who did what, and what went wrong"
    report = add_command(commands, "report", text, "live.report", "hvcpctl report --since 8h --html shift.html")
    add_memory(report, since="8h")
    add_tasks(report)
    report.add_argument("--html", type=Path, metavar="FILE", help="also write it as a page")


def _add_ros(commands: Commands) -> None:
    command = add_command(
        commands,
        "ros",
        "bridge a running robot to ROS 1 or ROS 2, until interrupted",
        "live.ros",
        "hvcpctl ros heard:=ears _base_frame:=base_footprint             # ROS 1",
        "hvcpctl ros --ros-args -r __ns:=/rob -p publish_tf:=false       # ROS 2",
        epilog=_WHICH + EXITS,
    )
    _add_which(command)
    command.add_argument(
        "--ros", choices=("1", "2"), help="version of ROS (default: ROS_VERSION, or what is installed)"
    )
    command.add_argument("remap", nargs="*", metavar="NAME:=VALUE", help="remappings and parameters, in ROS 1's syntax")
    command.add_argument("--ros-args", nargs=argparse.REMAINDER, metavar="…", help="the same, in ROS 2's syntax")


def _add_mqtt(commands: Commands) -> None:
    command = add_command(
        commands,
        "mqtt",
        "publish what a robot does to MQTT, and so to Home Assistant, until interrupted",
        "live.mqtt",
        "hvcpctl mqtt --host homeassistant.local --user robots --password-file ~/.mqtt",
        "mosquitto_pub -h homeassistant.local -t hvcpd/rob/command -m stop",
        epilog="Anybody who may write to PREFIX/NAME/command can stop the robot; with --commands also let it go on, "
        "and have it speak. " + _WHICH + EXITS,
    )
    _add_which(command)
    command.add_argument("--host", required=True, metavar="HOST", help="the broker")
    command.add_argument("--port", type=port, metavar="N", help="its port (default: 1883, with --tls 8883)")
    command.add_argument("--user", metavar="NAME", help="user name at the broker")
    command.add_argument(
        "--password-file", type=file_in, metavar="FILE", help="a file with that user's password; - for a pipe"
    )
    command.add_argument("--tls", action="store_true", help="encrypt, and check the broker's certificate")
    command.add_argument(
        "--prefix", default="hvcpd", metavar="TOPIC", help="prefix of all topics (default: %(default)s)"
    )
    command.add_argument(
        "--discovery", default="homeassistant", metavar="TOPIC", help="Home Assistant's prefix (default: %(default)s)"
    )
    command.add_argument("--commands", action="store_true", help="also obey `resume` and `say SENTENCE`")


def _add_mcap(commands: Commands) -> None:
    command = add_command(
        commands,
        "mcap",
        "write a recorded mission or shift as MCAP, for Foxglove",
        "live.mcap",
        "hvcpctl mcap out/demo mission.mcap",
        "hvcpctl mcap shift.jsonl shift.mcap",
        description="Write a recorded mission or shift as MCAP, for Foxglove: sentences, poses, sound.",
        epilog="RECORDING is the folder of `simulate --report DIR`, or what `follow --json --poses` printed "
        "(with --sound, too, and `control: {sound: true}` in the robot's settings: also what it heard).",
    )
    command.add_argument(
        "recording", type=file_in, metavar="RECORDING", help="a folder, or a file of JSON lines; - for a pipe"
    )
    command.add_argument("output", type=Path, metavar="FILE", help="the MCAP file")


def _add_console(commands: Commands) -> None:
    c = add_command(
        commands,
        "console",
        "show a robot, or a recorded mission, as a live page in the browser",
        "live.console",
        "hvcpctl console",
        "hvcpctl console --replay out/demo",
        description="Serve a page on this computer: the conversation, tasks, map, level, alarms, and a stop button.",
        epilog=_WHICH + EXITS,
    )
    _add_which(c)
    c.add_argument(
        "--port", type=port, default=8765, metavar="N", help="the page's port (default: %(default)s; 0: any)"
    )
    c.add_argument("--unix", type=Path, metavar="FILE", help="a UNIX socket instead of a port, for use with a tunnel")
    c.add_argument("--listen", default="127.0.0.1", metavar="ADDRESS", help="address (default: only this computer)")
    c.add_argument("--expose", action="store_true", help="allow an address that other computers can reach, unencrypted")
    c.add_argument("--replay", type=Path, metavar="DIR", help="a mission that `simulate --report DIR` has recorded")


def _add_which(command: argparse.ArgumentParser) -> None:
    """The options that say which daemon is meant."""
    add_config(command)
    command.add_argument("--name", type=robot_name, metavar="NAME", help="which robot, if several run here")
    command.add_argument("--socket", type=Path, metavar="FILE", help="the robot with this control socket")


def _add_task(commands: Commands) -> None:
    task = add_command(
        commands,
        "task",
        "repeat or skip a task; add and remove tasks while the robots work",
        "live.task",
        "hvcpctl task again 3",
        "hvcpctl task remove 11",
        description="Repeat or skip a task; add and remove tasks while the robots work. The robot tells the others "
        "about `again` and `skip` aloud. Give `add` and `remove` to each robot.",
    )
    actions = task.add_subparsers(title="actions", metavar="ACTION", required=True, dest="do")
    number = "the task's number, as `hvcpctl tasks` shows it"
    for name, what, example in (
        ("again", "do a task once more", "hvcpctl task again 3     # as if Anna said “task three again”"),
        ("skip", "leave a task out this time", "hvcpctl task skip 2"),
        ("remove", "remove a task from a robot", "hvcpctl task remove 11"),
    ):
        command = _add(actions, name, what, "live.task", example)
        command.add_argument("number", type=task_number, metavar="NUMBER", help=number)
    add = _add(
        actions,
        "add",
        "give a robot a new task",
        "live.task",
        'hvcpctl task add "water the red tulip" --number 11 --place 1.2,0.5 --action water=5',
        'hvcpctl task add "look at the gate" --number 12 --action dock --action wait=5 --every "6 h" --after 11',
    )
    add.add_argument("task_name", metavar="NAME", help="two to eight words, as robots say them")
    add.add_argument("--number", type=task_number, required=True, metavar="N", help="a free number, 1 to 99")
    add.add_argument("--place", type=place, metavar="X,Y", help="where, m; the robot goes there first (--place=-3,-4)")
    add.add_argument(
        "--action",
        action="append",
        default=[],
        metavar="WHAT[=VALUE]",
        help="what to do there, as the task file has it: `water=5`, `dock`, `pour={litres: 0.2}`; may be repeated",
    )
    add.add_argument(
        "--every", metavar="TIME", help="when it is due again: `6 h`, or a rule like `FREQ=DAILY;BYHOUR=8`"
    )
    add.add_argument("--after", type=task_numbers, metavar="N,N", help="tasks that must be done before it")
    add.add_argument(
        "--priority", type=whole(0, 9), metavar="0-9", help="of tasks that can be done, the highest comes first"
    )
    add.add_argument("--deadline", metavar="TIME", help="time after which a due task is late: `30 min`")
    add.add_argument("--robots", type=whole(1, 99), metavar="N", help="number of robots that carry it out together")


def _add(
    commands: Commands, name: str, text: str, run: str, *examples: str, which: str = _WHICH
) -> argparse.ArgumentParser:
    command = add_command(commands, name, text, run, *examples, epilog=which + EXITS)
    _add_which(command)
    add_json(command)
    return command


def _add_watch(command: argparse.ArgumentParser) -> None:
    command.add_argument("--watch", action="store_true", help="show it again every second, until interrupted")
