"""`hvcpctl say`: one sentence of the phrasebook, by a running robot, to the loudspeaker or to a file.

A robot that runs on this computer says a sentence in its name itself, when its turn comes. With --local, or with an
option about the sound (-o, --as, --voice, --rate, --gain-db, --natural, --lombard), this command makes the sound.
"""

from __future__ import annotations

import argparse
from contextlib import closing


def run(options: argparse.Namespace) -> int:
    """Have the sentence said by its speaker's daemon, or speak it in that voice."""
    if not _makes_the_sound(options):
        from hvcpd.control.say.asking import daemon_that_says, have_it_said  # not where none is asked

        if (daemon := daemon_that_says(options)) is not None:
            with closing(daemon):
                return have_it_said(options, daemon)
    from hvcpd.control.say.speaking import speak  # not where a robot says it: this loads the synthesizer

    return speak(options)


def _makes_the_sound(options: argparse.Namespace) -> bool:
    chosen = (options.output, options.voice_of, options.voice)
    delivery = (options.rate, options.gain_db, options.lombard) != (1.0, 0.0, False)
    return bool(options.local or options.natural or delivery or any(each is not None for each in chosen))
