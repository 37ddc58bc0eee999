"""Makes the sound of one sentence of the phrasebook here: what `hvcpctl say` does where no robot says it."""

from __future__ import annotations

import argparse

from hvcpd.assembly.voice_assignment import recorded_voice
from hvcpd.config.files import STANDARD_OUTPUT
from hvcpd.control.output import print_note, show
from hvcpd.control.say.sounding import write_or_play
from hvcpd.control.simulate.team import Team, load_team
from hvcpd.errors import PhraseError
from hvcpd.language.messages import for_robots
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.delivery import Delivery
from hvcpd.synthesis.speaker import Speaker

HEARD_RATES = (0.7, 1.25)
"""Slowest and fastest speaking rate that robots understand, relative to the usual one (`python -m benchmarks.hearing
--rows rate`)."""
HEARD_DB = 0.05
"""Differences of level below this are not reported."""


def speak(options: argparse.Namespace) -> None:
    """Speak the sentence in the voice of its speaker, as the command line has it."""
    voice_of: str | None = options.voice_of
    team = load_team(options, options.names or (), (voice_of,) if voice_of else ())
    typed = team.phrasebook.parse_text(options.text)
    if (utterance := for_robots(typed)) != typed:
        print_note(f"note: said as '{team.phrasebook.write(utterance)}', which robots hear")
    if voice_of and utterance.speaker and voice_of.lower() != utterance.speaker.lower():
        print_note(f"note: {utterance.speaker}'s words in {voice_of}'s voice")
    if not HEARD_RATES[0] <= options.rate <= HEARD_RATES[1]:
        least, most = HEARD_RATES
        print_note(f"note: for people; robots understand {least:g} to {most:g} of the usual rate")
    delivery = Delivery(options.rate, options.gain_db, options.lombard)
    phrases = team.phrasebook.phrases(utterance)
    speaker = _speaker(options, team, delivery, voice_of or utterance.speaker or team.settings.name, phrases)
    samples, gain_db = delivery.level(speaker.render(phrases))
    if gain_db < options.gain_db - HEARD_DB:
        print_note(f"note: only {gain_db:+.1f} dB; more would clip")
    write_or_play(samples, options.output, team.settings.audio.output_device)
    if options.json and options.output != STANDARD_OUTPUT:
        duration_s = len(samples) / SAMPLE_RATE_HZ
        written = team.phrasebook.write(utterance)
        file = str(options.output) if options.output is not None else None
        show(True, {"text": written, "duration_s": round(duration_s, 3), "file": file})


def _speaker(
    options: argparse.Namespace, team: Team, delivery: Delivery, name: str, phrases: tuple[tuple[str, ...], ...]
) -> Speaker:
    """The recorded voice that the options select, or that of the given robot."""
    is_recorded = options.voice is not None or name.lower() in team.sound.recorded
    if is_recorded and (options.natural or options.rate != 1.0):
        whose = options.voice if options.voice is not None else name
        raise PhraseError(f"--rate and --natural change the synthesizer's voice, not the recordings of {whose}")
    if options.voice is not None:
        return recorded_voice(options.voice, (word for phrase in phrases for word in phrase), team.sound.lexicon)
    if is_recorded:
        return team.sound.speaker_of(name)
    sound = team.sound.made_natural() if options.natural else team.sound
    return sound.speaker_in(delivery.voice(sound.voice_of(name)))
