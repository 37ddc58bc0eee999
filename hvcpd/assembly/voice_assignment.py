"""Which robot speaks with which voice, where the settings say so and it does not follow from the name.

It is another one of the synthesizer's, at its own pitch and rate or others, or a folder of recorded words, one WAV
each, named by its word: `water.wav`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from hvcpd.assembly.sound import Sound
from hvcpd.config.settings import PeerSettings, Settings
from hvcpd.errors import AudioFileError, ConfigError
from hvcpd.hardware.soundfile import read_wav
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.recorded import RecordedSpeaker
from hvcpd.synthesis.voices import Voice, varied, voice_for, voice_named

SHOWN = 40
"""Missing words that are named; who lacks more has only begun."""


def assign_voices(sound: Sound, settings: Settings, words: Callable[[], Iterable[str]]) -> Sound:
    """`sound` with the voices that the settings choose for the robot and its peers.

    `words` tells all that they may say, which a folder of recordings must have; a name that is learned later is said by
    the synthesizer. Raises ConfigError with every fault of every folder.
    """
    sound = sound.made_natural() if settings.synthesizer == "natural" else sound
    own = PeerSettings(settings.voice, settings.voice_folder, settings.pitch, settings.rate)
    chosen = [(f"peers.{name}.", name.lower(), peer) for name, peer in settings.peers.items()]
    chosen.append(("", settings.name.lower(), own))
    voices = {
        name: varied(voice_named(peer.voice) if peer.voice else voice_for(name), peer.pitch, peer.rate)
        for _, name, peer in chosen
    }
    recorded: dict[str, RecordedSpeaker] = {}
    faults = []
    for key, name, peer in chosen:
        if peer.voice_folder is not None:
            try:
                recorded[name] = recorded_voice(peer.voice_folder, words(), sound.lexicon, sound.said_by(voices[name]))
            except AudioFileError as error:
                faults.append(f"{key}voice_folder: {error}")
    if faults:
        raise ConfigError("\n".join(faults))
    return replace(sound, voices=voices, recorded=recorded)


def recorded_voice(
    folder: Path, words: Iterable[str], lexicon: Lexicon, stand_in: Voice | None = None
) -> RecordedSpeaker:
    """The voice of a folder, of which `words` are needed: any WAV that `hvcpctl hear` reads.

    `stand_in` says all others. Raises AudioFileError that names every word without a file, or every file of them that
    cannot be used, at once.
    """
    if not (os.access(folder, os.F_OK) and folder.is_dir()):
        raise AudioFileError(f"{folder}: there is no such folder; name one that holds a WAV for each word (water.wav)")
    try:
        files = {path.stem.lower(): path for path in sorted(folder.iterdir()) if path.suffix.lower() == ".wav"}
    except OSError as error:
        raise AudioFileError(f"{folder}: cannot be read ({error.strerror}); name another") from error
    wanted = sorted({word.lower() for word in words})
    missing = [word for word in wanted if word not in files]
    faults = []
    if missing:
        more = f" and {len(missing) - SHOWN} more" if len(missing) > SHOWN else ""
        faults.append(f"{folder}: no recording of {', '.join(missing[:SHOWN])}{more}; record each as WORD.wav")
    recordings = {}
    for word in wanted:
        if word in files:
            try:
                recordings[word] = read_wav(files[word], pipes=False)
            except AudioFileError as error:
                faults.append(str(error))
    speaker = RecordedSpeaker(recordings, lexicon, stand_in)
    faults += [f"{files[word]}: it is silent; record it again" for word in speaker.missing(recordings)]
    if faults:
        raise AudioFileError("\n".join(faults))
    return speaker
