"""The command line of `hvcpctl enrol`; light, since every command builds the whole parser."""

from __future__ import annotations

from pathlib import Path

from hvcpd.control.arguments import Commands, add_command, add_config, add_json, add_tasks

TAKES = 3
"""Takes of each word, because people do not say a word twice in the same way."""


def add_enrol(commands: Commands) -> None:
    """Add `enrol`."""
    enrol = add_command(
        commands,
        "enrol",
        "teach the robots a person's voice",
        "enrol.enrol",
        "hvcpctl enrol Anna",
        "hvcpctl enrol Anna --show              # the five sentences, to be recorded elsewhere",
        "hvcpctl enrol Anna --from takes/       # takes/sentence_1.wav, …; takes/stop_1.wav, takes/stop_2.wav, …",
        "hvcpctl enrol --list",
        "hvcpctl enrol Anna --export anna.npz",
        "hvcpctl enrol --import anna.npz",
        epilog="It asks for five sentences and listens; stop the daemon first, if it uses the same microphone. With "
        "--each-word it asks for each word of the phrasebook three times instead: for voices that the robots do "
        "not understand at all. A running robot uses what you enrolled after hvcpctl reload.",
    )
    enrol.add_argument("person", nargs="?", metavar="NAME", help="the person's name, one word, as in 'I am Anna'")
    add_config(enrol)
    add_tasks(enrol)
    enrol.add_argument("--state-dir", type=Path, metavar="DIR", help="where takes are kept (default: the settings')")
    enrol.add_argument("--each-word", action="store_true", help="ask for each word of the phrasebook, not sentences")
    enrol.add_argument("--words", metavar="stop,rob", help="ask for these words, not sentences")
    enrol.add_argument(
        "--takes", type=int, choices=range(1, 7), default=TAKES, help=f"takes of each word (default {TAKES})"
    )
    add_json(enrol, "print the result as one JSON object")
    action = enrol.add_mutually_exclusive_group()
    action.add_argument(
        "--from", dest="folder", type=Path, metavar="DIR", help="use WAVs: DIR/sentence_1.wav, DIR/WORD.wav, …"
    )
    action.add_argument("--show", action="store_true", help="print the sentences or words that it asks for")
    action.add_argument("--list", action="store_true", help="list who is enrolled")
    action.add_argument("--remove", action="store_true", help="forget the person")
    action.add_argument("--export", type=Path, metavar="FILE.npz", help="write the person's words to a file")
    action.add_argument(
        "--import", dest="import_", type=Path, metavar="FILE.npz", help="read a person from such a file"
    )
