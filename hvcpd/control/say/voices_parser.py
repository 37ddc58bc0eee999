"""The command line of `hvcpctl voices`."""

from __future__ import annotations

import argparse

from hvcpd.config.command_line import with_examples
from hvcpd.control.arguments import Commands, Run, add_config, robot_names, sound_out
from hvcpd.errors import did_you_mean


def add_voices(commands: Commands, run: Run) -> None:
    """Add `voices`."""
    c = commands.add_parser(
        "voices",
        help="compare the voices that robots have, and play them",
        epilog=with_examples(
            "A robot's voice follows from its name, or from the settings ('voice', 'peers').",
            "hvcpctl voices oak wren --text 'Hi all, I am Zorg' -o voices.wav",
        ),
    )
    c.add_argument("voices", nargs="*", type=_voice, metavar="VOICE", help="voices to compare (default: all eight)")
    c.add_argument("--natural", action="store_true", help="natural voices, whatever `synthesizer` the settings have")
    c.add_argument("--text", default="Hi all, I am here, water the yellow rose", help="what they say")
    add_config(c)
    whose = "show which robots have each voice (default: the settings')"
    c.add_argument("--names", type=robot_names, metavar="Rob,Bot", help=whose)
    text = "write a WAV instead of using the loudspeaker; - for a pipe"
    c.add_argument("-o", "--output", type=sound_out, metavar="FILE.wav", help=text)
    c.add_argument("--silent", action="store_true", help="only compare; play nothing")
    c.add_argument("--json", action="store_true", help="print one JSON object a voice")
    c.set_defaults(run=run)


def _voice(text: str) -> str:
    from hvcpd.synthesis.voices import VOICES

    known = [voice.name for voice in VOICES]
    if text.lower() not in known:
        raise argparse.ArgumentTypeError(f"{text!r} is not a voice; {did_you_mean(text, known)}")
    return text.lower()
