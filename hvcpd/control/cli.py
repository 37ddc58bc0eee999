"""The `hvcpctl` command: parses the command line, runs a command, turns errors into one message and a status."""

from __future__ import annotations

from hvcpd.config.interruption import interrupt_ends, unwrapped

with interrupt_ends():
    import argparse
    import gc
    import sys
    from collections.abc import Sequence
    from contextlib import suppress
    from typing import Any

    from hvcpd import __version__
    from hvcpd.config.command_line import (
        Parser,
        SkippedParser,
        discard_output,
        output_fault,
        prepare_streams,
        print_error,
    )
    from hvcpd.control.arguments import Commands, add_command
    from hvcpd.control.bench.bench_parser import add_bench
    from hvcpd.control.doctor.doctor_parser import add_doctor_commands
    from hvcpd.control.drive.drive_parser import add_drive
    from hvcpd.control.duet.duet_parser import add_duet
    from hvcpd.control.ending import ending_in_order
    from hvcpd.control.enrol.enrol_parser import add_enrol
    from hvcpd.control.hear.hear_parser import add_hear_commands
    from hvcpd.control.keys.key_parser import add_key_commands
    from hvcpd.control.live.daemon_parser import add_daemon_commands
    from hvcpd.control.overview import Overview
    from hvcpd.control.say.say_parser import add_say_commands
    from hvcpd.control.simulate.simulate_parser import add_simulate_commands
    from hvcpd.errors import EX_FAILURE, EX_INTERRUPTED, EX_OK, EX_USER, HvcpdError

NEW_OBJECTS = 50_000
"""Objects between two searches for cycles (Python's own: 700). A command makes about that many by its imports, and
nearly all of them stay: searching them took a twelfth of the time of `hvcpctl stop`."""


def make_parser(only: str | None = None) -> argparse.ArgumentParser:
    """The parser of all commands; of `only` that one, where it is given."""

    def wanted(**options: Any) -> Any:
        return Parser(**options) if only in (None, options["prog"].split()[-1]) else SkippedParser()

    parser_class: Any = wanted  # argparse calls it, and would not mind what it is
    parser: argparse.ArgumentParser = Overview(
        prog="hvcpctl", description="Try, watch and control robots that coordinate by speaking English."
    )
    parser.add_argument("--version", action="version", version=f"hvcpctl {__version__}")
    commands: Commands = parser.add_subparsers(
        metavar="COMMAND", required=True, dest="command", parser_class=parser_class
    )
    add_simulate_commands(commands)
    add_duet(commands)
    add_say_commands(commands)
    add_hear_commands(commands)
    add_daemon_commands(commands)
    add_doctor_commands(commands)
    add_drive(commands)
    add_enrol(commands)
    add_key_commands(commands)
    add_bench(commands)
    _add_completion(commands)
    return parser


def _add_completion(commands: Commands) -> None:
    completion = add_command(
        commands,
        "completion",
        "print what the shell needs to complete this command's words",
        "completion",
        "hvcpctl completion bash > ~/.local/share/bash-completion/completions/hvcpctl",
        "hvcpctl completion fish > ~/.config/fish/completions/hvcpctl.fish",
        'eval "$(hvcpctl completion zsh)"       # in ~/.zshrc, after compinit',
        epilog="Write it to the folder for completions; it works in the next shell.",
    )
    completion.add_argument("shell", choices=("bash", "zsh", "fish"), help="the shell")


@ending_in_order()
def main(arguments: Sequence[str] | None = None) -> int:
    """Run `hvcpctl`; returns the exit status."""
    gc.set_threshold(NEW_OBJECTS)
    prepare_streams()
    command = ""
    try:
        try:
            given = list(sys.argv[1:] if arguments is None else arguments)
            if given[:1] == ["help"]:  # as git and systemctl take it
                given = [*given[1:], "--help"]
            options = make_parser(next((each for each in given[:1] if each[:1] != "-"), None)).parse_args(given)
            command, run = options.command, options.run
            with unwrapped():
                status: int = run(options)
        finally:  # also after a help text, which ends by SystemExit
            sys.stdout.flush()
    except HvcpdError as error:
        print_error("hvcpctl", str(error))
        return error.command_status
    except BrokenPipeError:  # the reader of our output has gone, as in `hvcpctl hear x.wav | head -1`
        discard_output(sys.stdout)
        return EX_FAILURE if command == "simulate" else EX_OK  # a mission that was cut short is not done
    except (OSError, UnicodeEncodeError) as error:
        discard_output(sys.stdout)
        print_error("hvcpctl", output_fault(error))
        return EX_USER
    except KeyboardInterrupt:
        with suppress(OSError):
            sys.stderr.write("\n")
        return EX_INTERRUPTED
    return status


if __name__ == "__main__":
    sys.exit(main())
