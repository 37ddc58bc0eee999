"""`hvcpctl voices`: compares the eight voices in a table and by ear."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from hvcpd.assembly.sound import Sound, make_sound, user_cache_folder
from hvcpd.assembly.voice_assignment import assign_voices
from hvcpd.config.files import STANDARD_OUTPUT
from hvcpd.config.settings_file import load_settings
from hvcpd.control.say.sounding import require_few_words, sayable_phrases, write_or_play
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.synthesis.voices import VOICES, Voice, voice_named

BETWEEN_S = 0.6
"""Silence between two voices."""
SEMITONES_IN_OCTAVE = 12


def run(options: argparse.Namespace) -> None:
    """Print how the voices differ, then play them one after the other, or write them to a file."""
    settings = load_settings(options.config, name_needed=False)
    sound = assign_voices(make_sound(settings.lexicon, user_cache_folder(), settings.accent), settings, tuple)
    if options.natural:
        sound = sound.made_natural()
    names = options.names or tuple(dict.fromkeys((settings.name, *settings.names)))
    chosen = [sound.said_by(voice_named(name)) for name in options.voices] or _all_voices(sound, names)
    phrases = sayable_phrases(options.text)
    require_few_words(phrases)
    said = [sound.speaker_in(voice).render(phrases) for voice in chosen]
    rows = [_row(voice, samples, _whose(voice, names, sound)) for voice, samples in zip(chosen, said, strict=True)]
    if options.output != STANDARD_OUTPUT:
        sys.stdout.write("".join(json.dumps(row) + "\n" for row in rows) if options.json else _as_table(rows))
    if options.output is not None or not options.silent:
        write_or_play(_one_after_the_other(said), options.output, settings.audio.output_device)


def _all_voices(sound: Sound, names: Sequence[str]) -> list[Voice]:
    """The eight, and those of robots with another pitch or rate."""
    theirs = [sound.voice_of(name) for name in names if name.lower() not in sound.recorded]
    return list(dict.fromkeys([*sound.every_voice(), *theirs]))


def _whose(voice: Voice, names: Sequence[str], sound: Sound) -> list[str]:
    """Those of these robots that speak with the voice; robots with recorded voices have none of ours."""
    return [name for name in names if name.lower() not in sound.recorded and sound.voice_of(name) == voice]


def _row(voice: Voice, said: Samples, robots: Sequence[str]) -> dict[str, Any]:
    like = nearest(voice)
    return {
        "voice": voice.name,
        "pitch_hz": voice.f0_hz,
        "formants": voice.formant_scale,
        "centre_hz": round(spectral_centre_hz(said)),
        "duration_s": round(len(said) / SAMPLE_RATE_HZ, 2),
        "most_like": like.name,
        "pitch_apart_semitones": round(abs(SEMITONES_IN_OCTAVE * math.log2(like.f0_hz / voice.f0_hz)), 1),
        "robots": list(robots),
    }


def nearest(voice: Voice) -> Voice:
    """The other voice whose pitch and formants are least far away, both as ratios."""

    def distance(other: Voice) -> float:
        pitch, formants = other.f0_hz / voice.f0_hz, other.formant_scale / voice.formant_scale
        return math.hypot(math.log(pitch), math.log(formants))

    return min((other for other in VOICES if other.name != voice.name), key=distance)


def spectral_centre_hz(sound: Samples) -> float:
    """The mean frequency of a sound, shape (n,), weighted by magnitude: what makes a voice bright or dark."""
    magnitude = np.abs(np.fft.rfft(sound))
    hz = np.fft.rfftfreq(len(sound), 1.0 / SAMPLE_RATE_HZ)
    return float(np.sum(hz * magnitude) / np.sum(magnitude))


def _as_table(rows: Sequence[dict[str, Any]]) -> str:
    width = 2 + max(len("granite"), *(len(row["voice"]) for row in rows))
    lines = [f"{'voice':{width}}{'pitch':>8}{'formants':>10}{'centre':>10}{'time':>8}  {'most like':27}robots"]
    for row in rows:
        like = f"{row['most_like']}, {row['pitch_apart_semitones']:g} semitones off"
        lines.append(
            f"{row['voice']:{width}}{row['pitch_hz']:5.0f} Hz{row['formants']:10.2f}{row['centre_hz']:7.0f} Hz"
            f"{row['duration_s']:6.2f} s  {like:27}{', '.join(row['robots'])}".rstrip()
        )
    lines += [
        "",
        "pitch: mean; formants: times a man's; centre: of the spectrum, high is bright; time: of the sentence.",
    ]
    return "\n".join(lines) + "\n"


def _one_after_the_other(said: Sequence[Samples]) -> Samples:
    silence = np.zeros(samples_in(BETWEEN_S), np.float32)
    return np.concatenate([piece for samples in said for piece in (samples, silence)][:-1])
