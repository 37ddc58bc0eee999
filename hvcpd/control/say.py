"""`hvcpctl say`: one sentence of the phrasebook, to a file or the loudspeaker."""

from __future__ import annotations

import argparse
import sys

from hvcpd.config.names import valid_robot_name
from hvcpd.control.soundfile import write_wav
from hvcpd.control.team import load_team
from hvcpd.errors import PhraseError
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import voice_for


def run(options: argparse.Namespace) -> int:
    """Speak the sentence in the voice of its speaker."""
    voice_of: str | None = options.voice_of
    if voice_of is not None and (wrong := valid_robot_name(voice_of)):
        raise PhraseError(f"--as: {wrong}")
    team = load_team(options, options.names or (), (voice_of,) if voice_of else ())
    utterance = team.phrasebook.parse_text(options.text)
    if voice_of and utterance.speaker and voice_of.lower() != utterance.speaker.lower():
        sys.stderr.write(f"hvcpctl: note: {utterance.speaker}'s words in {voice_of}'s voice\n")
    name = voice_of or utterance.speaker or team.settings.name
    speaker = Speaker(voice_for(name), team.sound.lexicon, team.sound.cache)
    samples = speaker.render(team.phrasebook.phrases(utterance))
    if options.output is not None:
        write_wav(options.output, samples)
    else:
        from hvcpd.hardware.audio_play import play

        play(samples, team.settings.audio.output_device)
    return 0
