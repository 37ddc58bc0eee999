"""How well an independent recogniser understands our voices, beside espeak-ng and flite.

PocketSphinx, which knows nothing of our synthesizer, hears random sentences of the phrasebook with the phrasebook's own
network as its grammar, in near silence and in white noise 20 dB below the speech. Prints a table of sentences right.

    python -m benchmarks.voice [--sentences 40] [--wrong]
"""

from __future__ import annotations

import argparse
import random
import shutil
import subprocess
import tempfile
import time
import wave
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from pocketsphinx import Decoder, get_model_path

from hvcpd.language.graph import WordGraph
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

Phrases = tuple[tuple[str, ...], ...]

VOCABULARY = Vocabulary(
    names=("Rob", "Bot", "Max", "Zoe"),
    teams=("plant",),
    tasks=tuple(f"water the {colour} rose" for colour in ("green", "violet", "indigo", "orange", "yellow", "red")),
    numbers=tuple(range(1, 11)),
)
QUIET_RMS = 10.0 ** (-75 / 20)
"""The floor of the quiet condition, full scale = 1: PocketSphinx suffers over digital silence."""

PAD_S = 0.5


def judge(graph: WordGraph, folder: Path, lexicon: Lexicon) -> Decoder:
    """A PocketSphinx decoder with the network as its grammar, knowing our pronunciations beside its own."""
    lines = ["FSG_BEGIN phrasebook", f"NUM_STATES {graph.n_nodes + 1}", f"START_STATE {graph.start}"]
    lines.append(f"FINAL_STATE {graph.n_nodes}")
    lines += [f"TRANSITION {arc.source} {arc.target} 1.0 {arc.word}" for arc in graph.arcs]
    lines += [f"TRANSITION {node} {graph.n_nodes} 1.0" for node in sorted(graph.finals)]
    grammar = folder / "phrasebook.fsg"
    grammar.write_text("\n".join([*lines, "FSG_END", ""]))
    decoder = Decoder(
        hmm=get_model_path("en-us/en-us"), dict=get_model_path("en-us/cmudict-en-us.dict"), lm=None, loglevel="FATAL"
    )
    for word in graph.words:
        ours = " ".join(phone.rstrip("012") for phone in lexicon.pronounce(word))
        known = decoder.lookup_word(word)
        if known is None:
            decoder.add_word(word, ours, False)
        elif ours not in (known, *(decoder.lookup_word(f"{word}({n})") for n in range(2, 6))):
            # All programs say "bot" as we do, and not as the dictionary has it (B AO T).
            decoder.add_word(f"{word}(9)", ours, False)
    decoder.add_fsg("phrasebook", decoder.read_fsg(str(grammar)))
    decoder.activate_search("phrasebook")
    return decoder


def heard(decoder: Decoder, sound: Samples) -> str:
    """What the judge makes of a sound."""
    decoder.reinit_feat()
    decoder.start_utt()
    decoder.process_raw((np.clip(sound, -1, 1) * 32767).astype("<i2").tobytes(), full_utt=True)
    decoder.end_utt()
    hypothesis = decoder.hyp()
    return hypothesis.hypstr if hypothesis else ""


def in_noise(sound: Samples, snr_db: float | None, seed: int) -> Samples:
    """The sound with `PAD_S` around it in white noise; None is the quiet condition."""
    pad = np.zeros(round(PAD_S * SAMPLE_RATE_HZ), dtype=np.float32)
    padded = np.concatenate([pad, sound, pad])
    active = sound[np.abs(sound) > 0.01]
    level = QUIET_RMS if snr_db is None else float(np.sqrt(np.mean(active**2))) * 10.0 ** (-snr_db / 20)
    return (padded + level * np.random.default_rng(seed).standard_normal(len(padded))).astype(np.float32)


def program(command: Sequence[str]) -> Callable[[Phrases], Samples]:
    """A synthesizer outside: `command` with {text} and {wav}; its output is brought to 16 kHz by sox."""

    def speak(phrases: Phrases) -> Samples:
        text = ", ".join(" ".join(phrase) for phrase in phrases) + "."
        with tempfile.TemporaryDirectory() as folder:
            raw, wav = f"{folder}/raw.wav", f"{folder}/16k.wav"
            subprocess.run([part.format(text=text, wav=raw) for part in command], check=True, capture_output=True)
            form = ["-r", str(SAMPLE_RATE_HZ), "-c", "1", "-b", "16"]
            subprocess.run(["sox", raw, *form, wav, "norm", "-3"], check=True)
            with wave.open(wav) as file:
                data = np.frombuffer(file.readframes(file.getnframes()), dtype="<i2")
        return (data / 32768.0).astype(np.float32)

    return speak


def talkers(lexicon: Lexicon) -> dict[str, Callable[[Phrases], Samples]]:
    """Our eight voices and the programs that are installed."""
    found: dict[str, Callable[[Phrases], Samples]] = {voice.name: Speaker(voice, lexicon).render for voice in VOICES}
    if shutil.which("espeak-ng"):
        found["espeak-ng"] = program(["espeak-ng", "-v", "en-us", "-w", "{wav}", "{text}"])
    if shutil.which("flite"):
        for voice in ("slt", "rms"):
            found[f"flite {voice}"] = program(["flite", "-voice", voice, "-t", "{text}", "-o", "{wav}"])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sentences", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="names of talkers, separated by commas")
    parser.add_argument("--wrong", action="store_true", help="print what was misheard")
    options = parser.parse_args()
    lexicon = Lexicon.load()
    book = Phrasebook(VOCABULARY)
    chooser = random.Random(options.seed)
    sentences = [book.phrases(book.sample(chooser)) for _ in range(options.sentences)]
    conditions: dict[str, float | None] = {"quiet": None, "20 dB": 20.0}
    with tempfile.TemporaryDirectory() as folder:
        decoder = judge(book.graph, Path(folder), lexicon)
    print(f"{'talker':12}" + "".join(f"{name:>8}" for name in conditions) + f"{'length':>9}{'rtf':>8}")
    for name, speak in talkers(lexicon).items():
        if options.only and name not in options.only.split(","):
            continue
        started = time.perf_counter()
        sounds = [speak(phrases) for phrases in sentences]
        spent_s, length_s = time.perf_counter() - started, sum(map(len, sounds)) / SAMPLE_RATE_HZ
        row = f"{name:12}"
        misheard = []
        for condition, snr_db in conditions.items():
            right = 0
            for seed, (phrases, sound) in enumerate(zip(sentences, sounds, strict=True)):
                wanted = " ".join(word for phrase in phrases for word in phrase)
                got = heard(decoder, in_noise(sound, snr_db, seed))
                right += got == wanted
                if got != wanted:
                    misheard.append(f"    {condition}: {wanted}\n       -> {got}")
            row += f"{100.0 * right / len(sentences):7.1f}%"
        print(row + f"{length_s / len(sentences):8.2f}s{spent_s / length_s:8.4f}", flush=True)
        if options.wrong:
            print("\n".join(misheard))


if __name__ == "__main__":
    main()
