"""Which robot speaks with which voice, where the settings say so and it does not follow from the name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from hvcpd.assembly.make import Sound
from hvcpd.assembly.recorded_voices import recorded_voice
from hvcpd.config.settings import PeerSettings, Settings
from hvcpd.errors import AudioFileError, ConfigError
from hvcpd.synthesis.recorded import RecordedSpeaker
from hvcpd.synthesis.voices import voice_for, voice_named


def cast(sound: Sound, settings: Settings, words: Iterable[str]) -> Sound:
    """`sound` with the voices that the settings choose for the robot and its peers.

    `words` is all that they may say, which a folder of recordings must have; a name that is learned later is said by
    the synthesizer. Raises ConfigError with every fault of
    every folder.
    """
    own = PeerSettings(settings.voice, settings.voice_folder)
    chosen = {**{name.lower(): peer for name, peer in settings.peers.items()}, settings.name.lower(): own}
    words = sorted(words)
    voices = {name: voice_named(peer.voice) for name, peer in chosen.items() if peer.voice is not None}
    recorded: dict[str, RecordedSpeaker] = {}
    faults = []
    for name, peer in chosen.items():
        if peer.voice_folder is not None:
            try:
                recorded[name] = recorded_voice(
                    peer.voice_folder, words, sound.lexicon, voices.get(name) or voice_for(name)
                )
            except AudioFileError as error:
                faults.append(f"voice_folder: {error}")
    if faults:
        raise ConfigError("\n".join(faults))
    return replace(sound, voices=voices, recorded=recorded)
