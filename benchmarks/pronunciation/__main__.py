"""Learns letter-to-sound conversion, and measures them on held-out words.

    python -m benchmarks.pronunciation learn CMUDICT             # writes the two files of data in hvcpd/synthesis
    python -m benchmarks.pronunciation judge CMUDICT [--words FILE] [--number 1000] [--seed 1] [--wrong]

CMUDICT is the dictionary's own file, `cmudict-0.7b` or a later `cmudict.dict` (github.com/cmusphinx/cmudict). `judge`
keeps words back, learns from all others, and reads those kept back by letter to sound alone, as if no dictionary had
them: words that robots commonly use, any words of the dictionary, names of people and places. A word is exact if all
phones and all stresses are as in one of its pronunciations. Possessives of the same words are read by the rule, as the
word with an ending, and whole. British spellings of the dictionary's words in -ize and -yze are read whole: the rule
takes the dictionary's pronunciation instead. Of these an unstressed "i" may be a schwa.
"""

from __future__ import annotations

import argparse
import random
import re
import zoneinfo
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.pronunciation.align import LETTERS, align
from benchmarks.pronunciation.joint import train
from benchmarks.pronunciation.source import read_cmudict
from benchmarks.transcripts import edits
from hvcpd.evaluation.statistics import wilson
from hvcpd.language.rewording import known_names
from hvcpd.synthesis import letter_to_sound
from hvcpd.synthesis.dictionary import Pronunciation, pack
from hvcpd.synthesis.inflection import with_ending
from hvcpd.synthesis.letter_to_sound import LEAST_NATS, NATS, JointModel
from hvcpd.synthesis.lexicon import DICTIONARY_PATH, common_words

ORDER = 6
"""Tokens in the longest n-gram: with 8 no more of the words kept back are exact."""
THRESHOLD_NATS = 1e-6
"""Gain, a token of the training text, below which an n-gram is dropped: 3e-7 reads 1 % more, with twice as many."""

_IZE = re.compile(r"([iy])z(?=(?:e|ed|es|er|ers|ing|ation|ations|able)$)")
LEAST_LETTERS = 7
"""Of a verb in -ize: "prize" and "seized" have no other spelling."""

Words = Mapping[str, tuple[Pronunciation, ...]]
Read = Callable[[str], Pronunciation]


def learn(words: Words, path: Path) -> None:
    """Train the model on all pronunciations of the words and write it."""
    lessons = [(word, said) for word, all_said in words.items() if set(word) <= set(LETTERS) for said in all_said]
    aligned = align([lesson for lesson in lessons if len(lesson[0]) > 1])
    tokens = sorted({token for word in aligned for token in word})
    number = {token: at for at, token in enumerate(tokens)}
    begin, end = len(tokens), len(tokens) + 1
    texts = [[begin, *(number[token] for token in reversed(word)), end] for word in aligned]
    model = train(texts, end + 1, ORDER, THRESHOLD_NATS)
    graphones = "\n".join(f"{letter}{' '.join(phones)}" for letter, phones in tokens)
    np.savez_compressed(
        path,
        graphones=np.frombuffer(graphones.encode(), np.uint8),
        token=np.concatenate([[0], *model.tokens]).astype(np.uint16),
        cost=_in_steps(np.concatenate([[0.0], *model.log_p])),
        backoff=_in_steps(np.concatenate(model.log_backoff)),
        children=np.concatenate(model.children).astype(np.uint16),
        order=np.int64(ORDER),
    )


def _in_steps(log_p: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.uint8]]:
    return np.clip(np.round((-log_p - LEAST_NATS) / NATS), 0, 255).astype(np.uint8)


def bare(phones: Iterable[str]) -> tuple[str, ...]:
    """Phones without stress."""
    return tuple(phone.rstrip("012") for phone in phones)


def kept_back(words: Words, extra: Path | None, number: int, seed: int) -> dict[str, list[str]]:
    """The sets of words to be judged, of at most `number` each."""
    sets = {
        "words of robots": common_words(),
        "any words": words,
        "people and places": {
            *(name.lower() for name in known_names()),
            *(zone.rpartition("/")[2].lower() for zone in zoneinfo.available_timezones()),
        },
    }
    if extra is not None:
        sets[extra.name] = extra.read_text(encoding="utf-8").lower().split()
    chooser = random.Random(seed)
    found = {}
    for name, among in sets.items():
        known = sorted(word for word in among if word in words and len(word) > 2 and set(word) <= set(LETTERS))
        found[name] = chooser.sample(known, min(number, len(known)))
    return found


def british_spellings(words: Words) -> dict[str, str]:
    """The words in -ize and -yze by their British spellings, as far as these are not listed themselves."""
    spelt = {_IZE.sub(r"\1s", word): word for word in words if len(word) >= LEAST_LETTERS}
    return {british: word for british, word in spelt.items() if british not in words}


def judge(words: Words, read: Read, kept: Mapping[str, Sequence[str]], wrong: bool) -> None:
    """Print how each set is read."""
    for name, among in kept.items():
        exact = plain = far = 0
        for word in among:
            said = read(word)
            exact += said in words[word]
            plain += bare(said) in map(bare, words[word])
            far += is_far(said, words[word])
            if wrong and said not in words[word]:
                print(f"    {word}: {' '.join(said)} for {' '.join(words[word][0])}")
        counts = {"exact with stress": exact, "exact without": plain, "two phones or more wrong": far}
        show(name, len(among), counts)


def judge_rules(words: Words, read: Read, kept: Mapping[str, Sequence[str]], british: Mapping[str, str]) -> None:
    """Print how possessives of the words kept back are read, by the rule and whole, and British spellings, whole."""
    owners = [word for among in kept.values() for word in among if not word.endswith("s")]
    owned = {word: [with_ending(said, "s") for said in words[word]] for word in owners}
    by_rule = sum(is_soft(with_ending(read(word), "s"), owned[word]) for word in owners)
    whole = sum(is_soft(read(f"{word}s"), owned[word]) for word in owners)
    show("possessives", len(owners), {"exact by the rule": by_rule, "exact, read whole": whole})
    said = {spelt: read(spelt) for spelt in british}
    right = sum(is_soft(said[spelt], words[word]) for spelt, word in british.items())
    far = sum(is_far(said[spelt], words[word]) for spelt, word in british.items())
    show("British spellings", len(british), {"exact, read whole": right, "two phones or more wrong": far})


def is_far(said: Pronunciation, listed: Iterable[Pronunciation]) -> bool:
    """Whether two phones or more are wrong, stress aside."""
    return min(edits(bare(said), bare(each)) for each in listed) > 1


def is_soft(said: Pronunciation, listed: Iterable[Pronunciation]) -> bool:
    """Whether a word is exact, an unstressed "i" being as good as a schwa."""
    return soft(said) in map(soft, listed)


def soft(phones: Pronunciation) -> Pronunciation:
    """Phones with a schwa for each unstressed "i"."""
    return tuple("AH0" if phone == "IH0" else phone for phone in phones)


def show(name: str, n: int, counts: Mapping[str, int]) -> None:
    """Print shares of `n` words with their 95 % intervals."""
    print(f"{name}, n = {n}:")
    for what, count in counts.items():
        low, high = wilson(count, n)
        print(f"    {what:26}{count / n:6.3f} [{low:.3f}, {high:.3f}]")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("learn", "judge"))
    parser.add_argument("cmudict", type=Path)
    parser.add_argument("--words", type=Path, help="a file of other words to keep back and judge")
    parser.add_argument("--number", type=int, default=1000, help="of words in each set")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--wrong", action="store_true", help="print what was misread")
    options = parser.parse_args()
    words = read_cmudict(options.cmudict)
    if options.what == "learn":
        DICTIONARY_PATH.write_bytes(pack(words))
        learn(words, letter_to_sound.MODEL_PATH)
        for path in (DICTIONARY_PATH, letter_to_sound.MODEL_PATH):
            print(f"{path}: {path.stat().st_size:,} bytes")
        return
    kept = kept_back(words, options.words, options.number, options.seed)
    away = {word for among in kept.values() for word in among}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "model.npz"
        learn({word: said for word, said in words.items() if word not in away}, path)
        read = JointModel.load(path).read
        judge(words, read, kept, options.wrong)
        british = british_spellings(words)
        some = random.Random(options.seed).sample(sorted(british), min(options.number, len(british)))
        judge_rules(words, read, kept, {spelt: british[spelt] for spelt in some})


if __name__ == "__main__":
    main()
