"""Writes down what people say in folders of recordings, to train on: FOLDER/said.tsv, a name and words a line.

    python -m benchmarks.phones.transcribed DIR/games --model WHISPER

Whisper (A. Radford et al., ICML 2023) hears each recording in a window little longer than it, which takes a fifth of
the time of its 30 s; it then may say all of it again and again, of which the first is kept. Where lines.txt beside the
recordings has a line so like it (`ALIKE`), that is what was said; else it must be sure. Needs faster-whisper and
rapidfuzz; --model is a folder with a CTranslate2 model. No transcript is checked by hand.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence, Set
from pathlib import Path

import numpy as np

from benchmarks.phones.texts import common_words
from benchmarks.transcripts import whisper_model
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

MOST_S = 15.0
WINDOW_FRAMES = 400
FRAMES_PER_S = 100
ALIKE = 78.0
"""Percent of the letters of a known line and a transcript that are the same."""
SURE = -0.18
"""The least mean log probability of what is in no list of lines."""
LETTERS_PER_S = (3.0, 22.0)


def words_of(text: str, known: Set[str]) -> list[str]:
    """Words in small letters, with apostrophes where a dictionary has them."""
    found = re.findall(r"[a-z']+", text.lower().replace("\u2019", "'").replace("-", " "))
    return [word for word in (w if w in known else w.strip("'") for w in found) if word]


def said_once(words: Sequence[str]) -> list[str]:
    """Without its repetitions: `a b c a b` is `a b c`, since two words of the second time are enough."""
    for n in range(1, len(words) - 1):
        again = words[n:]
        if len(again) >= min(n, 3) and all(word == words[k % n] for k, word in enumerate(again)):
            return list(words[:n])
    return list(words)


def whisper(folder: Path) -> Callable[[Samples], tuple[str, float]]:
    """A Whisper model as a function from sound to text and its mean log probability."""
    whole = whisper_model(folder)
    import ctranslate2
    from faster_whisper.tokenizer import Tokenizer

    tokenizer = Tokenizer(whole.hf_tokenizer, whole.model.is_multilingual, task="transcribe", language="en")
    begin = [*tokenizer.sot_sequence, tokenizer.no_timestamps]

    def written(sound: Samples) -> tuple[str, float]:
        length = round(len(sound) / SAMPLE_RATE_HZ * FRAMES_PER_S)
        bands = whole.feature_extractor(sound)
        window = np.full((len(bands), max(length // 2 * 2 + 300, WINDOW_FRAMES)), bands.min(), np.float32)
        kept = min(bands.shape[1], length + 10)
        window[:, :kept] = bands[:, :kept]
        states = whole.model.encode(ctranslate2.StorageView.from_array(window[None]))
        most = 8 + 8 * length // FRAMES_PER_S
        (found,) = whole.model.generate(states, [begin], beam_size=1, return_scores=True, max_length=most)
        return tokenizer.decode(found.sequences_ids[0]), float(found.scores[0])

    return written


def nearest_of(text: str, lines: Sequence[str]) -> str | None:
    """The line that is most like it, if one is like it."""
    from rapidfuzz import fuzz, process

    found = process.extractOne(text, lines, scorer=fuzz.ratio, score_cutoff=ALIKE)
    return found[0] if found else None


def transcript(text: str, score: float, seconds: float, lines: Sequence[str], known: Set[str]) -> list[str]:
    """The words that were said, or none if they are not sure enough to be learned from."""
    words = said_once(words_of(text, known))
    if not words or re.search(r"\d", text):
        return []
    nearest = nearest_of(" ".join(words), lines) if lines else None
    words = nearest.split() if nearest else words
    pace = sum(map(len, words)) / seconds
    return words if (nearest or score > SURE) and LETTERS_PER_S[0] < pace < LETTERS_PER_S[1] else []


def lines_of(folder: Path, known: Set[str]) -> list[str]:
    """The known lines of a folder; of fewer than three letters, anything might be one."""
    listed = folder / "lines.txt"
    texts = listed.read_text(encoding="utf-8").splitlines() if listed.exists() else []
    return sorted({line for line in (" ".join(words_of(text, known)) for text in texts) if len(line) > 2})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("speech", type=Path)
    parser.add_argument("--model", type=Path, required=True)
    o = parser.parse_args()
    known, written = common_words().keys(), whisper(o.model)
    for folder in sorted({path.parent for path in o.speech.rglob("*.wav")}):
        n, paths, lines = 0, sorted(folder.glob("*.wav")), lines_of(folder, known)
        with (folder / "said.tsv").open("w", encoding="utf-8") as file:
            for path in paths:
                sound = np.asarray(read_wav(path), np.float32)
                seconds = len(sound) / SAMPLE_RATE_HZ
                words = transcript(*written(sound), seconds, lines, known) if seconds < MOST_S else []
                if words:
                    n += 1
                    file.write(f"{path.stem}\t{' '.join(words)}\n")
        print(f"{folder.name}: {n} of {len(paths)} recordings are written down", flush=True)


if __name__ == "__main__":
    main()
