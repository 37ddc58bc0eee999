"""The `hvcpctl` command: parses the command line, runs a command, turns errors into one message and a status."""

from __future__ import annotations

import argparse
import gc
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from hvcpd import __version__
from hvcpd.config.command_line import (
    Parser,
    Skipped,
    complain,
    let_go,
    output_fault,
    replace_closed_streams,
    with_examples,
)
from hvcpd.control.arguments import Commands, Run, add_config, add_tasks, between, robot_names, sound_in, sound_out
from hvcpd.control.bench.bench_parser import add_bench
from hvcpd.control.doctor.doctor_parser import add_calibrate, add_doctor, add_stop_test
from hvcpd.control.drive.drive_parser import add_drive
from hvcpd.control.duet.duet_parser import add_duet
from hvcpd.control.enrol.enrol_parser import add_enrol
from hvcpd.control.examples import add_examples
from hvcpd.control.keys.key_parser import add_key
from hvcpd.control.live.daemon_parser import (
    add_completion,
    add_daemon_commands,
    add_mcap,
    add_mqtt,
    add_ros,
    add_skills,
)
from hvcpd.control.overview import Overview
from hvcpd.control.say.playground_parser import add_playground
from hvcpd.control.say.voices_parser import add_voices
from hvcpd.control.simulate.evaluate_parser import add_evaluate
from hvcpd.control.simulate.new_team_parser import add_new_team
from hvcpd.control.simulate.simulate_parser import add_simulate
from hvcpd.errors import EX_FAILURE, EX_INTERRUPTED, EX_OK, EX_USER, HvcpdError

NEW_OBJECTS = 50_000
"""Objects between two searches for cycles (Python's own: 700). A command makes about that many by its imports, and
nearly all of them stay: searching them took a twelfth of the time of `hvcpctl stop`."""


def _lazy(module: str) -> Run:
    """The `run` of a command's module, imported only when it is needed, so that every command starts quickly."""

    def run(options: argparse.Namespace) -> int:
        from importlib import import_module

        command: Run = import_module(f"hvcpd.control.{module}").run
        return command(options)

    return run


def make_parser(only: str | None = None) -> argparse.ArgumentParser:
    """The parser of all commands; of `only` that one, where it is given."""

    def wanted(**options: Any) -> Any:
        return Parser(**options) if only in (None, options["prog"].split()[-1]) else Skipped()

    parser_class: Any = wanted  # argparse calls it, and would not mind what it is
    parser: argparse.ArgumentParser = Overview(
        prog="hvcpctl", description="Try, watch and control robots that coordinate by speaking English."
    )
    parser.add_argument("--version", action="version", version=f"hvcpctl {__version__}")
    commands: Commands = parser.add_subparsers(
        metavar="COMMAND", required=True, dest="command", parser_class=parser_class
    )
    add_simulate(commands, _lazy("simulate.simulate"))
    add_new_team(commands, _lazy("simulate.new_team"))
    add_duet(commands, _lazy("duet.duet"))
    _add_say(commands)
    _add_hear(commands)
    _add_listen(commands)
    add_enrol(commands, _lazy("enrol.enrol"))
    _add_phrases(commands)
    add_playground(commands, _lazy("say.playground"))
    _add_pronounce(commands)
    add_voices(commands, _lazy("say.voices"))
    _add_prerender(commands)
    _add_check_vocabulary(commands)
    _add_transcript(commands)
    _add_report(commands)
    _add_audit(commands)
    add_daemon_commands(commands, _lazy)
    add_key(commands, _lazy("keys.key"))
    add_drive(commands, _lazy("drive.drive"))
    add_doctor(commands, _lazy("doctor.doctor"))
    add_calibrate(commands, _lazy("doctor.calibrate"))
    add_bench(commands, _lazy("bench.bench"))
    add_stop_test(commands, _lazy("doctor.stop_test"))
    add_ros(commands, _lazy("live.ros"))
    add_skills(commands, _lazy("live.skills"))
    add_mqtt(commands, _lazy("live.mqtt"))
    add_mcap(commands, _lazy("live.mcap"))
    add_evaluate(commands, _lazy("simulate.evaluate"))
    add_completion(commands, _lazy("completion"))
    add_examples(parser)
    return parser


def _add_shared(command: argparse.ArgumentParser) -> None:
    add_config(command)
    add_tasks(command)
    command.add_argument("--names", type=robot_names, metavar="Rob,Bot", help="the names that the robots know")


def _add_key_option(command: argparse.ArgumentParser, text: str) -> None:
    command.add_argument("--key", type=Path, nargs="?", const=Path(), metavar="FILE", help=text)


def _add_say(commands: Commands) -> None:
    c = commands.add_parser(
        "say",
        help="speak one sentence of the phrasebook",
        epilog=with_examples(
            "If the sentence says '… I am Rob, …' and Rob runs on this computer, Rob says it when its turn comes, "
            "so that it interrupts nobody. Otherwise this command plays the sentence at once; so it does with --local, "
            "and with options for the sound (-o, --as, --voice, --rate, --gain-db, --natural, --lombard).",
            "hvcpctl say 'Hi Rob, I am Bot, water the yellow rose' -o yellow.wav",
        ),
    )
    _add_shared(c)
    c.add_argument("text", metavar="TEXT", help='for example "Hi Rob, I am Bot, water the yellow rose"')
    c.add_argument(
        "--as", dest="voice_of", metavar="NAME", help="use this robot's voice (default: the one in 'I am …')"
    )
    text = "write a WAV instead of using the loudspeaker; - for a pipe"
    c.add_argument("-o", "--output", type=sound_out, metavar="FILE.wav", help=text)
    c.add_argument("--rate", type=between(0.5, 2.0), default=1.0, metavar="R", help="above 1 faster, below slower")
    c.add_argument("--gain-db", type=between(-60.0, 20.0), default=0.0, metavar="DB", help="louder or softer")
    c.add_argument("--natural", action="store_true", help="a natural voice, whatever `synthesizer` the settings have")
    c.add_argument("--lombard", action="store_true", help="for people in noise: clearer consonants, brighter, louder")
    c.add_argument("--voice", type=Path, metavar="DIR", help="speak with recorded words, one WAV each: DIR/water.wav")
    c.add_argument("--local", action="store_true", help="do not ask a running robot to say it")
    c.add_argument("--name", metavar="NAME", help="let this robot say it, which must run here")
    c.add_argument("--socket", type=Path, metavar="FILE", help="let the robot with this control socket say it")
    c.add_argument("--json", action="store_true", help="print what was said as a JSON object")
    c.set_defaults(run=_lazy("say.say"))


def _add_hear(commands: Commands) -> None:
    c = commands.add_parser("hear", help="list every sentence in a recording")
    _add_shared(c)
    c.add_argument("file", type=sound_in, nargs="+", metavar="FILE.wav", help="WAV, FLAC, AIFF or Ogg; - for a pipe")
    c.add_argument("--json", action="store_true", help="print one JSON object a line")
    c.add_argument(
        "--learn-alternatives",
        action="store_true",
        help="propose alternatives for words that were not understood, to paste into the task file",
    )
    c.add_argument("--said", metavar="TEXT", help="the sentence that was said, if you know it")
    _add_key_option(c, "also hear seals; with the team's key, check them and decrypt")
    c.add_argument("--plot", type=Path, metavar="FILE.png", help="draw spectrum, words, noise and confidence")
    c.set_defaults(run=_lazy("hear.hear"))


def _add_listen(commands: Commands) -> None:
    c = commands.add_parser("listen", help="listen to the microphone and print what robots say, until interrupted")
    _add_shared(c)
    _add_key_option(c, "also hear seals; with the team's key, check them and decrypt")
    c.add_argument("--device", metavar="NAME", help="a part of the microphone's name (default: the settings')")
    c.add_argument("--json", action="store_true", help="print one JSON object a line")
    c.set_defaults(run=_lazy("hear.listen"))


def _add_phrases(commands: Commands) -> None:
    c = commands.add_parser("phrases", help="print the card: every sentence that robots understand")
    _add_shared(c)
    c.add_argument("--format", choices=("text", "markdown", "html"), default="text", help="default: text")
    c.add_argument("--key", action="store_true", help="include seals and codes (default: if the settings name a key)")
    c.add_argument("--json", action="store_true", help="print the card as one JSON object")
    c.set_defaults(run=_lazy("say.phrases"))


def _add_check_vocabulary(commands: Commands) -> None:
    c = commands.add_parser("check-vocabulary", help="find words that could be confused, and better ones")
    _add_shared(c)
    c.add_argument("--json", action="store_true", help="print one JSON object a line")
    c.set_defaults(run=_lazy("say.check_vocabulary"))


def _add_memory(command: argparse.ArgumentParser) -> None:
    add_config(command)
    command.add_argument("--name", metavar="NAME", help="the robot whose memory to read (default: from the settings)")
    command.add_argument("--memory", type=Path, metavar="FILE", help="this memory file, in any folder")
    command.add_argument("--socket", type=Path, metavar="FILE", help="the memory of the robot with this control socket")
    command.add_argument(
        "--since", metavar="WHEN", help="start this long ago (30m, 8h, 2d) or at this time (2026-11-21T08:00)"
    )
    command.add_argument("--json", action="store_true", help="print one JSON object a line")


def _add_transcript(commands: Commands) -> None:
    c = commands.add_parser("transcript", help="print what a robot said and heard")
    _add_memory(c)
    c.add_argument("--follow", action="store_true", help="go on with new sentences, until interrupted")
    c.set_defaults(run=_lazy("live.transcript"))


def _add_audit(commands: Commands) -> None:
    c = commands.add_parser("audit", help="count who ordered whom, what was refused, and how the tasks were shared")
    _add_memory(c)
    add_tasks(c)
    c.set_defaults(run=_lazy("keys.audit"))


def _add_report(commands: Commands) -> None:
    c = commands.add_parser("report", help="describe a shift: who did what, and what went wrong")
    _add_memory(c)
    c.set_defaults(since="8h")
    add_tasks(c)
    c.add_argument("--html", type=Path, metavar="FILE", help="also write it as a page")
    c.set_defaults(run=_lazy("live.report"))


def _add_pronounce(commands: Commands) -> None:
    c = commands.add_parser("pronounce", help="show how words are pronounced, and why")
    c.add_argument("words", nargs="*", metavar="WORD", help="words, or phrases in quotes: 'wind the clock'")
    add_config(c)
    c.add_argument("--lexicon", type=Path, metavar="FILE", help="your own pronunciations (default: the settings')")
    c.add_argument("--paper-table", action="store_true", help="the words of the paper's table I")
    c.add_argument("--as", dest="voice_of", default="Rob", metavar="NAME", help="whose voice, for -o and --track")
    c.add_argument("-o", "--output", type=sound_out, metavar="FILE.wav", help="write the words as sound; - for a pipe")
    c.add_argument("--track", type=Path, metavar="FILE.csv", help="write the synthesizer's frames of one word")
    c.add_argument("--json", action="store_true", help="print one JSON object a word")
    c.set_defaults(run=_lazy("say.pronounce"))


def _add_prerender(commands: Commands) -> None:
    c = commands.add_parser("prerender", help="render all words of the phrasebook in advance")
    _add_shared(c)
    c.add_argument("--json", action="store_true", help="print the result as one JSON object")
    c.set_defaults(run=_lazy("say.prerender"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `hvcpctl`; returns the exit status."""
    gc.set_threshold(NEW_OBJECTS)
    replace_closed_streams()
    command = ""
    try:
        try:
            given = list(sys.argv[1:] if arguments is None else arguments)
            if given[:1] == ["help"]:  # as git and systemctl take it
                given = [*given[1:], "--help"]
            options = make_parser(next((each for each in given[:1] if each[:1] != "-"), None)).parse_args(given)
            command, run = options.command, options.run
            status: int = run(options)
        finally:  # also after a help text, which ends by SystemExit
            sys.stdout.flush()
    except HvcpdError as error:
        complain("hvcpctl", str(error))
        return error.command_status
    except BrokenPipeError:  # the reader of our output has gone, as in `hvcpctl hear x.wav | head -1`
        let_go(sys.stdout)
        return EX_FAILURE if command == "simulate" else EX_OK  # a mission that was cut short is not done
    except (OSError, UnicodeEncodeError) as error:
        let_go(sys.stdout)
        complain("hvcpctl", output_fault(error))
        return EX_USER
    except KeyboardInterrupt:
        with suppress(OSError):
            sys.stderr.write("\n")
        return EX_INTERRUPTED
    return status


if __name__ == "__main__":
    sys.exit(main())
