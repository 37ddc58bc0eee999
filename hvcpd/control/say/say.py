"""`hvcpctl say`: one sentence of the phrasebook, by a running robot, to the loudspeaker or to a file.

A robot that runs on this computer says a sentence in its name itself, when its turn comes. With --local, or with an
option about the sound (-o, --as, --voice, --rate, --gain-db, --natural, --lombard), this command makes the sound.
"""

from __future__ import annotations

import argparse
from contextlib import closing

from hvcpd.errors import ConfigError


def run(options: argparse.Namespace) -> None:
    """Have the sentence said by its speaker's daemon, or speak it in that voice."""
    sound = _sound_option(options)
    robot = next((option for option in ("name", "socket") if getattr(options, option) is not None), None)
    if sound is not None and robot is not None:
        raise ConfigError(f"--{robot} has a robot say it, which {sound} does not change; leave one of the two out")
    if sound is None:
        from hvcpd.control.say.asking import daemon_that_says, have_it_said  # not where none is asked

        if (daemon := daemon_that_says(options)) is not None:
            with closing(daemon):
                have_it_said(options, daemon)
                return
    from hvcpd.control.say.speaking import speak  # not where a robot says it: this loads the synthesizer

    speak(options)


def _sound_option(options: argparse.Namespace) -> str | None:
    """The first of the given options with which this command makes the sound."""
    given = {
        "-o": options.output is not None,
        "--as": options.voice_of is not None,
        "--voice": options.voice is not None,
        "--rate": options.rate != 1.0,
        "--gain-db": options.gain_db != 0.0,
        "--natural": options.natural,
        "--lombard": options.lombard,
        "--local": options.local,
    }
    return next((option for option, is_given in given.items() if is_given), None)
