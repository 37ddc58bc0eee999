"""The command line of `duet`; light, since every command builds the whole parser."""

from __future__ import annotations

from pathlib import Path

from hvcpd.control.arguments import Commands, add_command, add_tasks, port, robot_name, robot_names


def add_duet(commands: Commands) -> None:
    """Add `duet`."""
    c = add_command(
        commands,
        "duet",
        "let two robots talk through this computer's loudspeaker and microphone; join in",
        "duet.duet",
        "hvcpctl duet",
        "hvcpctl duet --as Rob         # and on another computer: hvcpctl duet --as Bot",
        description="Start two whole daemons with simulated wheels. They talk through this computer's loudspeaker and "
        "microphone, or through simulated air where there is none. Speak to them, or type what you would say.",
        epilog="On two computers within earshot, start one robot on each with --as.",
    )
    who = "the robots (default: the first two of the settings)"
    c.add_argument("--names", type=robot_names, metavar="Rob,Bot", help=who)
    c.add_argument("--as", dest="as_name", type=robot_name, metavar="NAME", help="run only this robot here")
    c.add_argument("--pipe", action="store_true", help="use simulated air even where there is a sound card")
    c.add_argument("--input-device", metavar="NAME", help="a part of the microphone's name (default: the settings')")
    c.add_argument("--output-device", metavar="NAME", help="a part of the loudspeaker's name (default: the settings')")
    c.add_argument("--config", type=Path, metavar="FILE", help="settings file (default: none)")
    add_tasks(c)
    c.add_argument("--port", type=port, default=0, metavar="N", help="port of the console's page (default: any)")
    c.add_argument("--no-console", action="store_true", help="show the conversation in the terminal only")
