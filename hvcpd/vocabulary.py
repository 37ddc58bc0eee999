"""Checks a team's words before they are spoken: which would be taken for one another, and what to say instead."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hvcpd.assembly import Sound, templates_of
from hvcpd.language.phrasebook import RESERVED_WORDS, Phrasebook
from hvcpd.language.words import NUMBER_MAX, number_words
from hvcpd.recognition.competition import Pair, Phrase, competing_phrases
from hvcpd.recognition.separation import CONDITIONS, Condition, ConfusionCurve, VoiceSounds
from hvcpd.synthesis.unit_cache import recipe
from hvcpd.synthesis.voices import Voice

CANDIDATES_PATH = Path(__file__).parent / "config" / "candidate_words.txt"
HARDEST = CONDITIONS[-1:]
"""Where distances are least: pairs that are far apart here need no closer look."""
EVERY = 2
"""Of the frames one in so many for the first look, at a quarter of the cost."""
FAR = 22.0
"""Distance at that first look beyond which a pair is let go: twice that over all frames, where no pair at all was
confused (benchmarks/vocabulary.py)."""
LIMIT_QUIET = 0.001
"""In quiet nothing may go wrong: fewer than one substitution in 1,000 is what is asked of the hearing as a whole."""
LIMIT_NOISE = 0.01
"""Robots are to hear 99 of 100 sentences in noise: a word that is confused more often at 0 dB spoils it alone."""
FIXED_WORDS = RESERVED_WORDS.union(*(number_words(n) for n in range(NUMBER_MAX + 1)))
"""The forms' own words and the numbers: a team can choose none of them."""
SAME = 1.0
"""A distance below this in quiet is the same sound: one step of the DTW off the diagonal costs 0.3."""
PROPOSALS = 3
"""Replacements named for each word."""


@dataclass(frozen=True)
class Confusion:
    """Two phrases that compete, the voice in which they are worst, and how often one is heard as the other.

    Rates are of the worse direction, 0 to 0.5: in quiet, and in the worse of white and pink noise at 0 and -5 dB.
    """

    first: str
    second: str
    voice: str
    same_sound: bool
    quiet: float
    at_0_db: float
    at_minus_5_db: float
    fixed: bool
    """Both are the phrasebook's own: a team cannot reword them, and is not refused for them."""
    proposals: tuple[str, ...] = ()
    alternative_of: str = ""
    """The word as which `first` or `second`, an alternative of the task file, counts."""

    @property
    def confusable(self) -> bool:
        """Whether a rate is over its limit."""
        return self.quiet > LIMIT_QUIET or self.at_0_db > LIMIT_NOISE


def describe(confusion: Confusion) -> str:
    """One sentence: what is wrong, how much, and the remedy."""
    c = confusion
    what = "sound the same" if c.same_sound else "would be taken for one another"
    rates = f"{c.quiet:.1%} of the time in quiet, {c.at_0_db:.1%} in noise at 0 dB"
    remedy = "reword one of them"
    if c.alternative_of:
        remedy = f"leave the alternative of '{c.alternative_of}' out of the task file"
    elif c.proposals:
        *others, last = c.proposals
        remedy = (
            f"instead of '{' '.join(_subject(c)[0])}' say for example {', '.join(others)}{' or ' * bool(others)}{last}"
        )
    return f"'{c.first}' and '{c.second}' {what} ({rates}, predicted); {remedy}"


def refusal(confusions: Iterable[Confusion]) -> str | None:
    """Why a team's words cannot be used, one line a pair; None when they can."""
    lines = [describe(c) for c in confusions if c.confusable and not c.fixed]
    return "\n".join(lines) + "\nTo use them all the same: --allow-confusable" if lines else None


def check(
    book: Phrasebook, names: Iterable[str], sound: Sound, cache: Path | None = None, chosen_only: bool = False
) -> tuple[Confusion, ...]:
    """The pairs of `book` that come near one another in the voices of `names`, worst first.

    With `cache`, a folder, what was found for the same words, voices and program is kept there. `chosen_only`, for a
    quick start, leaves out what no change of a single task, team or robot's name would mend.
    """
    counts_as = {phrase: word for word, phrases in book.alternatives.items() for phrase in phrases}
    pairs = tuple(pair for pair in competing_phrases(book.heard_graph) if not _is_same(pair, counts_as))
    if chosen_only:
        pairs = tuple(pair for pair in pairs if _is_chosen(*pair) or counts_as.keys() & set(pair))
    voices = tuple({sound.voice_of(name): None for name in names})
    spoken = {word: sound.lexicon.pronunciations(word) for word in book.heard_graph.words}
    content = f"{_recipe()} {counts_as!r} {pairs!r} {voices!r} {sorted(spoken.items())!r}"
    path = cache / (hashlib.sha256(content.encode()).hexdigest()[:32] + ".json") if cache is not None else None
    found = _read(path)
    if found is None:
        found = tuple(_of_alternative(c, counts_as) for c in _find(pairs, voices, sound))
        _write(path, found)
    return found


def _is_same(pair: Pair, counts_as: Mapping[Phrase, str]) -> bool:
    """Whether both sides of a pair are understood as the same word."""
    first, second = (counts_as.get(phrase, " ".join(phrase)) for phrase in pair)
    return first == second


def _of_alternative(c: Confusion, counts_as: Mapping[Phrase, str]) -> Confusion:
    """An alternative is the team's, whatever words it is made of."""
    words = (counts_as.get(tuple(phrase.split())) for phrase in (c.first, c.second))
    word = next((word for word in words if word is not None), None)
    return c if word is None else replace(c, fixed=False, proposals=(), alternative_of=word)


def _is_chosen(first: Phrase, second: Phrase) -> bool:
    """Whether a team chose a word of both phrases, or the one word that one of them is."""
    chosen = [any(word not in FIXED_WORDS for word in phrase) for phrase in (first, second)]
    alone = [len(phrase) == 1 for phrase in (first, second)]
    return all(chosen) or (chosen[0] and alone[0]) or (chosen[1] and alone[1])


def _find(pairs: Sequence[Pair], voices: Sequence[Voice], sound: Sound) -> tuple[Confusion, ...]:
    words = sorted({word for pair in pairs for phrase in pair for word in phrase})
    if not pairs:
        return ()
    worst: dict[Pair, Confusion] = {}
    for voice in voices:
        rendered = templates_of(words, voice, sound)
        rough = VoiceSounds({word: takes[:1] for word, takes in rendered.items()}, HARDEST, EVERY)
        near = [p for p, d in _distances(rough, pairs).items() if float(d.min()) < FAR]
        for pair, distances in _distances(VoiceSounds(rendered), near).items():
            confusion = judge(pair, voice, distances)
            if pair not in worst or _badness(confusion) > _badness(worst[pair]):
                worst[pair] = confusion
    worst |= {pair: _homophones(pair) for pair in pairs if _may_sound_the_same(pair, sound)}
    found = sorted(worst.values(), key=lambda c: (-_badness(c), c.first, c.second))
    return tuple(_with_proposals(c, pairs, voices, sound) for c in found)


def _may_sound_the_same(pair: Pair, sound: Sound) -> bool:
    """Whether some pronunciation of the one is one of the other: a speaker may choose it, as of "read"."""
    if max(map(len, pair)) > 1:
        return False
    first, second = (set(sound.lexicon.sounds(phrase[0])) for phrase in pair)
    return bool(first & second)


def _homophones(pair: Pair) -> Confusion:
    fixed = all(phrase[0] in FIXED_WORDS for phrase in pair)
    return Confusion(pair[0][0], pair[1][0], "any", True, 0.5, 0.5, 0.5, fixed)


def _badness(confusion: Confusion) -> float:
    return confusion.at_0_db + confusion.quiet


def _distances(sounds: VoiceSounds, pairs: Sequence[Pair]) -> dict[Pair, NDArray[np.float32]]:
    """For each pair the distance of the worse direction in each condition."""
    others: dict[Phrase, list[Phrase]] = {}
    for a, b in pairs:
        others.setdefault(a, []).append(b)
        others.setdefault(b, []).append(a)
    out: dict[Pair, NDArray[np.float32]] = {}
    for phrase, rivals in others.items():
        for rival, distance in zip(rivals, sounds.distances(phrase, rivals).T, strict=True):
            pair = (phrase, rival) if phrase < rival else (rival, phrase)
            out[pair] = np.minimum(out[pair], distance) if pair in out else distance
    return out


def judge(pair: Pair, voice: Voice, distances: NDArray[np.float32]) -> Confusion:
    """What these distances, one for each of CONDITIONS, mean for the pair."""
    rate = ConfusionCurve().rate

    def worst(snr_db: float | None) -> float:
        return max(rate(float(d)) for d, c in zip(distances, CONDITIONS, strict=True) if c.snr_db == snr_db)

    fixed = all(word in FIXED_WORDS for phrase in pair for word in phrase)
    same = float(distances[CONDITIONS.index(Condition())]) < SAME
    return Confusion(
        " ".join(pair[0]), " ".join(pair[1]), voice.name, same, worst(None), worst(0.0), worst(-5.0), fixed
    )


def read_candidates(path: Path = CANDIDATES_PATH) -> dict[str, tuple[str, ...]]:
    """Well-separated words by their kind: "colour", "flower", "name", …"""
    lines = (line.partition("#")[0].strip() for line in path.read_text(encoding="utf-8").splitlines())
    kinds = (line.partition(":") for line in lines if line)
    return {kind.strip(): tuple(words.split()) for kind, _, words in kinds}


def _with_proposals(c: Confusion, pairs: Sequence[Pair], voices: Sequence[Voice], sound: Sound) -> Confusion:
    if not c.confusable or c.fixed:
        return c
    subject, kept = _subject(c)
    places = {b if a == subject else a for a, b in pairs if subject in (a, b)} | {kept}
    used = {word for pair in pairs for phrase in pair for word in phrase}
    wanted = [w for w in _alternatives(subject, kept, places) if w.lower() not in used]
    proposals = best_apart(wanted, sorted(places), voices, sound)
    fields = dict(vars(c), proposals=proposals)
    return Confusion(**fields)


def _subject(c: Confusion) -> tuple[Phrase, Phrase]:
    """The phrase to be replaced, one of the team's words where there is one, and the other."""
    sides = [tuple(c.first.split()), tuple(c.second.split())]
    sides.sort(key=lambda phrase: (all(w in FIXED_WORDS for w in phrase), -len(phrase)))
    return sides[0], sides[1]


def _alternatives(subject: Phrase, kept: Phrase, places: set[Phrase]) -> tuple[str, ...]:
    """Candidates of the kind that most of what competes there is of; a name for a name."""
    near = [word for phrase in (subject, kept, *places) for word in phrase]

    def likeness(words: tuple[str, ...]) -> int:
        known = {word.lower() for word in words}
        return sum(word in known for word in near)

    kinds = read_candidates()
    if any(phrase[0] in ("all", "team") for phrase in places):
        return kinds["name"]
    return max(kinds.values(), key=likeness) if any(map(likeness, kinds.values())) else kinds["alphabet"]


def best_apart(
    words: Sequence[str], rivals: Sequence[Phrase], voices: Sequence[Voice], sound: Sound
) -> tuple[str, ...]:
    """Up to PROPOSALS of `words`, those farthest from the nearest of `rivals` in noise; none that is near."""
    if not words:
        return ()
    spoken = {word for phrase in rivals for word in phrase} | {word.lower() for word in words}
    nearest = dict.fromkeys(words, np.inf)
    for voice in voices:
        rendered = templates_of(sorted(spoken), voice, sound)
        sounds = VoiceSounds({word: takes[:1] for word, takes in rendered.items()}, HARDEST)
        for word in words:
            pairs = [((word.lower(),), rival) for rival in rivals]
            distances = _distances(sounds, [(a, b) if a < b else (b, a) for a, b in pairs])
            nearest[word] = min(nearest[word], *(float(d.min()) for d in distances.values()))
    rate: Callable[[float], float] = ConfusionCurve().rate
    good = [word for word in words if rate(nearest[word]) < LIMIT_NOISE]
    return tuple(sorted(good, key=lambda word: -nearest[word])[:PROPOSALS])


def _recipe() -> str:
    """A digest of the programs that decide, so that what older ones found is not found any more."""
    folder = Path(__file__).parent
    names = "competition separation templates frontend decoder scorer".split()
    sources = [Path(__file__), CANDIDATES_PATH, *(folder / "recognition" / f"{name}.py" for name in names)]
    return recipe() + hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()


def as_dict(confusion: Confusion) -> dict[str, object]:
    """For JSON; rates rounded to a hundredth of a percent."""
    return {k: round(v, 4) if isinstance(v, float) else v for k, v in vars(confusion).items()}


def _read(path: Path | None) -> tuple[Confusion, ...] | None:
    """What was kept; None when there is nothing, or not in this form."""
    if path is None:
        return None
    try:
        rows: list[Mapping[str, object]] = json.loads(path.read_text(encoding="utf-8"))
        return tuple(Confusion(**{**row, "proposals": tuple(row["proposals"])}) for row in rows)  # type: ignore[arg-type]
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _write(path: Path | None, found: Sequence[Confusion]) -> None:
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".part")
        partial.write_text(json.dumps([vars(c) for c in found]), encoding="utf-8")
        partial.replace(path)
    except OSError:
        pass  # a full or read-only disk costs time at the next start, no more
