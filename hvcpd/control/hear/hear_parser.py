"""The command lines of `hvcpctl hear` and `listen`; light, since every command builds the whole parser."""

from __future__ import annotations

from pathlib import Path

from hvcpd.control.arguments import Commands, add_command, add_json, add_key_file, add_team, file_in

_SEALS = "also hear seals; with the team's key, check them and decrypt"


def add_hear_commands(commands: Commands) -> None:
    """Add `hear` and `listen`."""
    text = "list every sentence in a recording, and where a robot would halt"
    hear = add_command(commands, "hear", text, "hear.hear", "hvcpctl hear yellow.wav", "hvcpctl hear yellow.wav --json")
    add_team(hear)
    hear.add_argument("file", type=file_in, nargs="+", metavar="FILE.wav", help="WAV, FLAC, AIFF or Ogg; - for a pipe")
    add_json(hear)
    hear.add_argument(
        "--learn-alternatives",
        action="store_true",
        help="suggest alternatives for words that were not understood, to paste into the task file",
    )
    hear.add_argument("--said", metavar="TEXT", help="say how close this sentence was to being understood")
    add_key_file(hear, _SEALS)
    hear.add_argument("--plot", type=Path, metavar="FILE.png", help="draw spectrum, words, noise and confidence")
    text = "listen to the microphone and print what robots say, until interrupted"
    listen = add_command(commands, "listen", text, "hear.listen", "hvcpctl listen", "hvcpctl listen --names Rob,Bot")
    add_team(listen)
    add_key_file(listen, _SEALS)
    listen.add_argument("--device", metavar="NAME", help="a part of the microphone's name (default: the settings')")
    add_json(listen)
