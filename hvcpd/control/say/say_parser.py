"""The command lines about speech and words: `say`, `phrases`, `playground`, `pronounce`, `voices`, `prerender` and
`check-vocabulary`; light, since every command builds the whole parser."""

from __future__ import annotations

import argparse
from pathlib import Path

from hvcpd.control.arguments import (
    Commands,
    add_command,
    add_config,
    add_json,
    add_sound_out,
    add_tasks,
    add_team,
    between,
    robot_name,
    robot_names,
    table_out,
)
from hvcpd.errors import did_you_mean

_WAV = "write a WAV instead of using the loudspeaker; - for a pipe"


def add_say_commands(commands: Commands) -> None:
    """Add all of them."""
    _add_say(commands)
    _add_phrases(commands)
    _add_playground(commands)
    _add_pronounce(commands)
    _add_voices(commands)
    text = "render all words of the phrasebook in advance"
    prerender = add_command(commands, "prerender", text, "say.prerender", "hvcpctl prerender --names Rob,Bot")
    add_team(prerender)
    add_json(prerender, "print the result as one JSON object")
    text = "find words that could be confused, and better ones"
    example = "hvcpctl check-vocabulary --tasks tasks.yaml --names Rob,Bot"
    check = add_command(commands, "check-vocabulary", text, "say.check_vocabulary", example)
    add_team(check)
    add_json(check)


def _add_say(commands: Commands) -> None:
    c = add_command(
        commands,
        "say",
        "speak one sentence of the phrasebook",
        "say.say",
        "hvcpctl say 'Hi Rob, I am Bot, water the yellow rose' -o yellow.wav",
        epilog="If the sentence says '… I am Rob, …' and Rob runs on this computer, Rob says it when its turn comes, "
        "so that it interrupts nobody. Otherwise this command plays the sentence at once; so it does with --local, "
        "and with options for the sound (-o, --as, --voice, --rate, --gain-db, --natural, --lombard).",
    )
    add_team(c)
    c.add_argument("text", metavar="TEXT", help='for example "Hi Rob, I am Bot, water the yellow rose"')
    whose = c.add_mutually_exclusive_group()
    text = "use this robot's voice (default: the one in 'I am …')"
    whose.add_argument("--as", dest="voice_of", type=robot_name, metavar="NAME", help=text)
    text = "speak with recorded words, one WAV each: DIR/water.wav"
    whose.add_argument("--voice", type=Path, metavar="DIR", help=text)
    add_sound_out(c, _WAV)
    c.add_argument(
        "--rate", type=between(0.5, 2.0), default=1.0, metavar="R", help="rate: above 1 faster, below slower"
    )
    c.add_argument(
        "--gain-db", type=between(-60.0, 20.0), default=0.0, metavar="DB", help="gain: above 0 louder, below softer"
    )
    c.add_argument("--natural", action="store_true", help="a natural voice, whatever `synthesizer` the settings have")
    c.add_argument("--lombard", action="store_true", help="for people in noise: clearer consonants, brighter, louder")
    c.add_argument("--local", action="store_true", help="do not ask a running robot to say it")
    c.add_argument("--name", type=robot_name, metavar="NAME", help="let this robot say it; it must run here")
    c.add_argument("--socket", type=Path, metavar="FILE", help="let the robot with this control socket say it")
    add_json(c, "print what was said as a JSON object")


def _add_phrases(commands: Commands) -> None:
    examples = ("hvcpctl phrases --tasks tasks.yaml", "hvcpctl phrases --format html > card.html")
    text = "print the card: every sentence that robots understand"
    c = add_command(commands, "phrases", text, "say.phrases", *examples)
    add_team(c)
    c.add_argument("--format", choices=("text", "markdown", "html"), default="text", help="default: text")
    c.add_argument("--key", action="store_true", help="include seals and codes (default: if the settings name a key)")
    add_json(c, "print the card as one JSON object")


def _add_playground(commands: Commands) -> None:
    text = "write a page in which robots say what you type, for any browser"
    about = f"{text[0].upper()}{text[1:]}, offline."
    c = add_command(commands, "playground", text, "say.playground", "hvcpctl playground", description=about)
    add_config(c)
    add_tasks(c)
    who = "who speaks, 2 to 4 (default: the settings' `names`)"
    c.add_argument("--robots", type=robot_names, metavar="Rob,Bot", help=who)
    where, file = "where to write it (default: %(default)s)", Path("playground.html")
    c.add_argument("-o", "--output", type=Path, default=file, metavar="FILE.html", help=where)


def _add_pronounce(commands: Commands) -> None:
    text = "show how words are pronounced, and why"
    c = add_command(commands, "pronounce", text, "say.pronounce", "hvcpctl pronounce geranium")
    c.add_argument("words", nargs="*", metavar="WORD", help="words, or phrases in quotes: 'wind the clock'")
    add_config(c)
    c.add_argument("--lexicon", type=Path, metavar="FILE", help="your own pronunciations (default: the settings')")
    c.add_argument("--paper-table", action="store_true", help="the words of the paper's table I")
    whose = "whose voice, for -o and --track (default: Rob's)"
    c.add_argument("--as", dest="voice_of", type=robot_name, metavar="NAME", help=whose)
    add_sound_out(c, "write the words as sound; - for a pipe")
    text = "write the synthesizer's frames of one word; - for a pipe"
    c.add_argument("--track", type=table_out, metavar="FILE.csv", help=text)
    add_json(c, "print one JSON object a word")


def _add_voices(commands: Commands) -> None:
    c = add_command(
        commands,
        "voices",
        "compare the voices that robots have, and play them",
        "say.voices",
        "hvcpctl voices oak wren --text 'Hi all, I am Zorg' -o voices.wav",
        epilog="A robot's voice follows from its name, or from the settings ('voice', 'peers').",
    )
    c.add_argument("voices", nargs="*", type=_voice, metavar="VOICE", help="voices to compare (default: all eight)")
    c.add_argument("--natural", action="store_true", help="natural voices, whatever `synthesizer` the settings have")
    c.add_argument("--text", default="Hi all, I am here, water the yellow rose", help="what they say")
    add_config(c)
    whose = "show which robots have each voice (default: the settings')"
    c.add_argument("--names", type=robot_names, metavar="Rob,Bot", help=whose)
    add_sound_out(c, _WAV)
    c.add_argument("--silent", action="store_true", help="only compare; play nothing")
    add_json(c, "print one JSON object a voice")


def _voice(text: str) -> str:
    from hvcpd.synthesis.voices import VOICES

    known = [voice.name for voice in VOICES]
    if text.lower() not in known:
        raise argparse.ArgumentTypeError(f"{text!r} is not a voice; {did_you_mean(text, known)}")
    return text.lower()
