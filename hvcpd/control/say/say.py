"""`hvcpctl say`: one sentence of the phrasebook, by a running robot, to the loudspeaker or to a file.

A robot that runs on this computer says a sentence in its name itself, when its turn comes. With --local, or with an
option about the sound (-o, --as, --voice, --rate, --gain-db, --natural, --lombard), this command makes the sound.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from contextlib import closing

from hvcpd.assembly.voice_assignment import recorded_voice
from hvcpd.config.names import valid_robot_name
from hvcpd.control.live.daemon_client import DaemonClient, find_daemon, find_daemon_of
from hvcpd.control.simulate.team import Team, load_team
from hvcpd.errors import EX_OK, NotAllowedError, NotDoneError, NotRunningError, PhraseError
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.delivery import Delivery
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

HEARD_RATES = (0.7, 1.75)
"""Slowest and fastest speaking rate that robots understand, relative to the usual one (measured; a template is
stretched to twice its length or half of it)."""
HEARD_DB = 0.05
"""Differences of level below this are not reported."""


SAID_WITHIN_S = 60.0
"""Time for a robot's turn to come: seconds among few robots, up to a minute in a crowd that never falls silent."""

_SPEAKER = re.compile(r"\bi\s+am\s+([a-z][a-z0-9]*)", re.IGNORECASE)


def run(options: argparse.Namespace) -> int:
    """Have the sentence said by its speaker's daemon, or speak it in that voice."""
    daemon = None if _makes_the_sound(options) else _daemon_that_says(options)
    if daemon is None:
        return _play(options)
    with closing(daemon):
        return _have_it_said(options, daemon)


def _makes_the_sound(options: argparse.Namespace) -> bool:
    chosen = (options.output, options.voice_of, options.voice)
    delivery = (options.rate, options.gain_db, options.lombard) != (1.0, 0.0, False)
    return bool(options.local or options.natural or delivery or any(each is not None for each in chosen))


def _daemon_that_says(options: argparse.Namespace) -> DaemonClient | None:
    """The daemon of the speaker in "I am …"; for a sentence without a name, the one that the options select."""
    if options.name is not None or options.socket is not None:
        return find_daemon(options)
    speaker = _SPEAKER.search(options.text)
    if speaker:
        return find_daemon_of(speaker[1], options)
    try:
        return find_daemon(options)
    except (NotRunningError, NotAllowedError):
        return None


def _have_it_said(options: argparse.Namespace, daemon: DaemonClient) -> int:
    daemon.ask("subscribe", events=["said"])
    text = daemon.ask("say", text=options.text)["text"]
    try:
        said = next(event for event in daemon.events(SAID_WITHIN_S) if event.get("text") == text)
    except NotDoneError:
        raise NotDoneError(f"{daemon.name} had no chance to say it for {SAID_WITHIN_S:g} s") from None
    if options.json:
        sys.stdout.write(json.dumps(said) + "\n")
    else:
        sys.stdout.write(f"{daemon.name} says: {text}\n")
    return EX_OK


def _play(options: argparse.Namespace) -> int:
    """Speak the sentence in the voice of its speaker."""
    voice_of: str | None = options.voice_of
    if voice_of is not None and (wrong := valid_robot_name(voice_of)):
        raise PhraseError(f"--as: {wrong}")
    if options.voice is not None and options.rate != 1.0:
        raise PhraseError("--rate changes the synthesizer's voice, not recordings; leave it out")
    team = load_team(options, options.names or (), (voice_of,) if voice_of else ())
    utterance = team.phrasebook.parse_text(options.text)
    if voice_of and options.voice is None and utterance.speaker and voice_of.lower() != utterance.speaker.lower():
        sys.stderr.write(f"hvcpctl: note: {utterance.speaker}'s words in {voice_of}'s voice\n")
    if not HEARD_RATES[0] <= options.rate <= HEARD_RATES[1]:
        least, most = HEARD_RATES
        sys.stderr.write(f"hvcpctl: note: for people; robots understand {least:g} to {most:g} of the usual rate\n")
    delivery = Delivery(options.rate, options.gain_db, options.lombard)
    phrases = team.phrasebook.phrases(utterance)
    speaker = _speaker(options, team, delivery, voice_of or utterance.speaker or team.settings.name, phrases)
    samples, gain_db = delivery.level(speaker.render(phrases))
    if gain_db < options.gain_db - HEARD_DB:
        sys.stderr.write(f"hvcpctl: note: only {gain_db:+.1f} dB; more would clip\n")
    if options.output is not None:
        write_wav(options.output, samples)
    else:
        from hvcpd.hardware.audio_play import play

        play(samples, team.settings.audio.output_device)
    if options.json:
        duration_s = len(samples) / SAMPLE_RATE_HZ
        written = team.phrasebook.write(utterance)
        file = str(options.output) if options.output is not None else None
        sys.stdout.write(json.dumps({"text": written, "duration_s": round(duration_s, 3), "file": file}) + "\n")
    return EX_OK


def _speaker(
    options: argparse.Namespace, team: Team, delivery: Delivery, name: str, phrases: tuple[tuple[str, ...], ...]
) -> Speaker:
    """The recorded voice that the options select, or that of the given robot."""
    if options.voice is not None:
        return recorded_voice(options.voice, (word for phrase in phrases for word in phrase), team.sound.lexicon)
    if name.lower() in team.sound.recorded:
        if delivery.voice(VOICES[0]) != VOICES[0]:
            raise PhraseError(f"--rate changes the synthesizer's voice, and {name} has recordings")
        return team.sound.speaker_of(name)
    sound = team.sound.made_natural() if options.natural else team.sound
    return Speaker(delivery.voice(sound.voice_of(name)), sound.lexicon, sound.cache)
