"""Ten sentences, each by one of our voices, by espeak-ng and by flite: one WAV and one picture a sentence.

In a WAV the three speak one after the other at the same level; in its picture their spectrograms (8 ms window, 0 to
8 kHz, 50 dB from white to black) stand one below the other in the same order. With --voices an Opus file for each of
our voices instead, which says one sentence by the formant synthesizer, natural, and so with --lombard.

    python -m benchmarks.side_by_side [--voice brook] [--voices] docs/voice
"""

from __future__ import annotations

import argparse
import struct
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from benchmarks.judging import talkers
from hvcpd.hardware.soundfile import write_wav
from hvcpd.language.words import spoken_words
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.delivery import Delivery
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

SENTENCES = (
    "stop",
    "resume",
    "turn right",
    "who is here",
    "what is left",
    "come back",
    "bot, stop",
    "hi, i am rob",
    "hi, i am zoe",
    "hi bot, i am rob, water the yellow rose",
)
OTHERS = ("espeak-ng", "flite rms")
LEVEL_RMS = 0.08
WINDOW, HOP, RANGE_DB = 128, 96, 50.0
"""Samples, samples, dB: a wide-band spectrogram, in which single glottal pulses and bursts stand out."""
GREYS = 7


def trimmed(sound: Samples) -> Samples:
    """The sound at the common level, with 50 ms of what is around it."""
    sound = sound * np.float32(LEVEL_RMS / float(np.sqrt(np.mean(sound**2))))
    loud = np.flatnonzero(np.abs(sound) > 0.05 * LEVEL_RMS)
    edge = SAMPLE_RATE_HZ // 20
    return sound[max(0, loud[0] - edge) : loud[-1] + edge]


def spectrogram(sound: Samples) -> NDArray[np.float64]:
    """0 (quiet) to 1 (loudest), shape (WINDOW, frames), the highest frequency first; 6 dB an octave are added."""
    steep = np.append(sound[:1], sound[1:] - 0.95 * sound[:-1])
    frames = np.stack([steep[k : k + WINDOW] for k in range(0, len(steep) - WINDOW, HOP)]) * np.hanning(WINDOW)
    level = 10.0 * np.log10(np.abs(np.fft.rfft(frames, 2 * WINDOW)) ** 2 + 1e-9).T[:0:-1]
    return np.asarray(np.clip((level - level.max() + RANGE_DB) / RANGE_DB, 0.0, 1.0))


def write_png(path: Path, grey: NDArray[np.uint8]) -> None:
    """An 8-bit greyscale picture, shape (height, width)."""
    height, width = grey.shape
    rows = b"".join(b"\0" + row.tobytes() for row in grey)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows, 9)),
        (b"IEND", b""),
    )
    body = b"".join(struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in chunks)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def one_after_the_other(sounds: Sequence[Samples]) -> Samples:
    """The sounds with a third of a second between two."""
    pause = np.zeros(SAMPLE_RATE_HZ // 3, np.float32)
    return np.concatenate([piece for sound in sounds for piece in (sound, pause)][:-1])


def write_voices(folder: Path) -> None:
    """Write `SENTENCES`' last in each voice, three times, as Ogg Opus."""
    lexicon = Lexicon.load()
    phrases = [spoken_words(part) for part in SENTENCES[-1].split(",")]
    for voice in VOICES:
        natural = replace(voice, natural=True)
        loud = Delivery(lombard=True)
        said = [Speaker(each, lexicon).render(phrases) for each in (voice, natural, loud.voice(natural))]
        sounds = [trimmed(said[0]), trimmed(said[1]), trimmed(loud.level(said[2])[0])]
        path = folder / f"{voice.name}.opus"
        soundfile.write(path, one_after_the_other(sounds), SAMPLE_RATE_HZ, format="OGG", subtype="OPUS")
        print(f"{path}  {path.stat().st_size / 1000:.0f} kB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--voice", default="brook", help="which of ours (brook is Rob's)")
    parser.add_argument("--voices", action="store_true", help="each of ours, and no other")
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    if options.voices:
        write_voices(options.folder)
        return
    present = talkers(Lexicon.load())
    names = [name for name in (options.voice, *OTHERS) if name in present]
    for number, sentence in enumerate(SENTENCES, start=1):
        phrases = [spoken_words(part) for part in sentence.split(",")]
        sounds = [trimmed(present[name].speak(phrases)) for name in names]
        write_wav(options.folder / f"{number:02d}.wav", one_after_the_other(sounds))
        images = [spectrogram(sound) for sound in sounds]
        width = max(image.shape[1] for image in images)
        rows = [np.pad(image, ((0, 4), (0, width - image.shape[1]))) for image in images]
        picture = 255 - np.round(np.concatenate(rows) * GREYS) * (255 // GREYS)
        write_png(options.folder / f"{number:02d}.png", picture.astype(np.uint8))
        print(f"{number:02d}  {sentence}  ({', '.join(names)})")


if __name__ == "__main__":
    main()
