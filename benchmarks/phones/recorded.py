"""Recordings of real people, split by speaker into training, calibration and test.

The split is a rule: a hash of the speaker, or of the file where nobody knows who speaks (`part_of`). Nothing that is
for tests is heard while the net is trained or its confidence fitted.
"""

from __future__ import annotations

import hashlib
import random
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.keyword.clips import part_of as keyword_part_of
from benchmarks.keyword.clips import trimmed
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

CALIBRATION_SHARE = 15
"""Percent of the speakers that the keyword's net is trained on and that this net leaves for calibration, with those
that the keyword's leaves to validate."""
DIGIT_SPEAKERS = ("george", "jackson")
"""Whose first takes of digits are trained on; the other speakers of the digits are for tests alone."""
DIGIT_TAKES = 5
HELD_OUT_NOISES = ("aircon_2", "dishwasher_3")
"""As the keyword's benchmark holds them out; and of the kitchen's noise the second half."""
MOST_WORDS, MOST_GAP_S = 4, 0.35
"""Of a string of words by one speaker."""

GROUPS_FOR_CALIBRATION, GAME_FOR_TESTS = 12, "drascula"
"""Percent of the dialogues and scenes in games (`games.py`), and the one that nothing learns from."""

COFFEE_ORDERS = Path(__file__).parent / "coffee_orders.tsv"
"""What is said in recordings of people, by the first eight letters of their names: written by Whisper tiny.en and
corrected by hand, since the recordings came without."""


def part_of(speaker: str) -> str:
    """`train`, `calibration` or `test`; a speaker that tests the keyword tests this net, too."""
    part = keyword_part_of(speaker)
    if part == "train" and hashlib.sha256(speaker.encode()).digest()[1] % 100 >= CALIBRATION_SHARE:
        return "train"
    return "test" if part == "test" else "calibration"


def half_of(path: Path) -> str:
    """`train` or `test`: a recording of which nobody knows the speaker."""
    return keyword_part_of(path.stem, half=True)


def half_in(folder: Path, part: str) -> list[Path]:
    """The recordings of one half, in order."""
    return [path for path in sorted(folder.rglob("*.wav")) if half_of(path) == part]


@dataclass(frozen=True, eq=False)
class Utterance:
    """What somebody said, as words, and the sound of it."""

    words: tuple[str, ...]
    speaker: str
    sound: Samples


def words(data: Path, part: str) -> list[Utterance]:
    """Single words by people (DIR/words/WORD/SPEAKER_nohash_TAKE.wav), of one part of the speakers."""
    found = []
    for path in sorted((data / "words").rglob("*.wav")):
        speaker = path.name.split("_")[0]
        if part_of(speaker) == part:
            found.append(Utterance((path.parent.name,), speaker, np.asarray(read_wav(path), np.float32)))
    return found


def bare_words(data: Path, part: str, names: Sequence[str]) -> list[Utterance]:
    """Words of one part of the speakers without the silence around them, to train on with digits, whose `names` begin
    with zero's."""
    found = [Utterance(u.words, u.speaker, trimmed(u.sound)) for u in words(data, part)]
    for path in sorted((data / "digits").glob("*.wav")) if part == "train" else ():
        digit, speaker, take = path.stem.split("_")
        if speaker in DIGIT_SPEAKERS and int(take) < DIGIT_TAKES:
            found.append(Utterance((names[int(digit)],), speaker, trimmed(np.asarray(read_wav(path), np.float32))))
    return [u for u in found if len(u.sound) > SAMPLE_RATE_HZ // 10]


def string_of(said: Sequence[Utterance], chooser: random.Random) -> Utterance:
    """Words by one of the speakers, one after the other, with or without pauses."""
    first = chooser.choice(said)
    mine = [u for u in said if u.speaker == first.speaker]
    chosen = [first, *(chooser.choice(mine) for _ in range(chooser.randint(1, MOST_WORDS - 1)))]
    parts = []
    for utterance in chosen:
        gap_s = chooser.choice((0.0, chooser.uniform(0.0, MOST_GAP_S)))
        parts += [utterance.sound, np.zeros(round(gap_s * SAMPLE_RATE_HZ), np.float32)]
    return Utterance(tuple(w for u in chosen for w in u.words), first.speaker, np.concatenate(parts))


def orders_of_coffee(data: Path, part: str) -> list[Utterance]:
    """Sentences by people, each by somebody else, of one half (`train` or `test`): what COFFEE_ORDERS says of the
    recordings in DIR/negatives."""
    lines = (line.split("\t") for line in COFFEE_ORDERS.read_text(encoding="utf-8").splitlines())
    said = {name: tuple(text.split()) for name, text in lines}
    heard = ((said[p.stem[:8]], p) for p in half_in(data / "negatives", part) if p.stem[:8] in said)
    return [Utterance(text, p.stem, trimmed(np.asarray(read_wav(p), np.float32))) for text, p in heard]


def game_part_of(path: Path) -> str:
    """`train`, `calibration` or `test`: a line of a game, GAME/GROUP_LINE. The hero of the Amazon Queen is in all of
    its dialogues and trains."""
    group = path.name.split("_")[0]
    if path.parent.name == GAME_FOR_TESTS:
        return "test"
    number = hashlib.sha256(group.encode()).digest()[0] % 100
    return "train" if group == "joe" or number >= GROUPS_FOR_CALIBRATION else "calibration"


def lines_of_games(data: Path, part: str) -> list[Utterance]:
    """What `transcribed.py` wrote down of the recordings in DIR/games/GAME, of one part; none without them."""
    found = []
    for listed in sorted((data / "games").glob("*/said.tsv")):
        for line in listed.read_text(encoding="utf-8").splitlines():
            name, text = line.split("\t")
            path = listed.with_name(f"{name}.wav")
            if game_part_of(path) == part:
                sound = trimmed(np.asarray(read_wav(path), np.float32))
                found.append(Utterance(tuple(text.split()), name.split("_")[0], sound))
    return found


def noises(data: Path, part: str) -> list[Samples]:
    """Noises of one part (`train` or `test`), full scale = 1: machines, a kitchen, sounds, and talk that is nobody's to
    understand."""
    found = [
        np.asarray(read_wav(path), np.float32)
        for path in sorted((data / "noises").glob("*.wav"))
        if (path.stem in HELD_OUT_NOISES) == (part == "test")
    ]
    kitchen = np.asarray(read_wav(data / "kitchen.wav"), np.float32)
    half = len(kitchen) // 2
    found.append(kitchen[:half] if part == "train" else kitchen[half:])
    return [*found, joined(data / "sounds", part)]


def joined(folder: Path, part: str) -> Samples:
    """The recordings of one half, one after the other, all as loud."""
    sounds = [np.asarray(read_wav(path), np.float32) for path in half_in(folder, part)]
    return np.concatenate([s * (0.1 / max(float(np.sqrt(np.mean(s**2))), 1e-5)) for s in sounds])
