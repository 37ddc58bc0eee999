"""Checks a team's words before they are spoken: words that would be confused, and replacements for them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import cattrs
import numpy as np
from numpy.typing import NDArray

from hvcpd.assembly.separation import CONDITIONS, Condition, ConfusionCurve, VoiceSounds
from hvcpd.assembly.sound import Sound
from hvcpd.config.document import place_of
from hvcpd.config.files import write_whole
from hvcpd.errors import PhraseError
from hvcpd.language.clashes import RESERVED_WORDS
from hvcpd.language.competition import Pair, Phrase, competing_phrases
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.language.rewording import (
    SYNONYMS_PATH,
    example_sentences,
    instead_of_name,
    instead_of_noun,
    instead_of_team,
    instead_of_verb,
)
from hvcpd.language.words import NUMBER_MAX, SAFETY_WORDS, number_words, spoken_words
from hvcpd.synthesis.lexicon import Origin
from hvcpd.synthesis.likeness import near_names
from hvcpd.synthesis.unit_cache import recipe
from hvcpd.synthesis.voices import Voice

HARDEST = CONDITIONS[-1:]
"""The condition in which distances are least: pairs that are far apart in it are not compared in the others."""
EVERY = 2
"""Step between the frames that the first comparison takes, which so costs a quarter."""
FAR = 22.0
"""Such a distance from which pairs are skipped: 44 over all frames, where none was confused (benchmarks/vocabulary)."""
LIMIT_QUIET = 0.001
"""In quiet nothing may go wrong: the whole recogniser is to make fewer than one substitution in 1,000."""
LIMIT_NOISE = 0.01
"""Robots are to hear 99 of 100 sentences in noise: a word that is confused more often at 0 dB spoils it alone."""
FIXED_WORDS = RESERVED_WORDS.union(*(number_words(n) for n in range(NUMBER_MAX + 1)))
"""The forms' own words and the numbers: a team can choose none of them."""
ARTICLES = frozenset(("a", "an", "the"))
"""Of two that alone tell two tasks apart, none can be replaced: one of the tasks needs another name."""
SAME = 1.0
"""A distance below this in quiet is the same sound: one step of the DTW off the diagonal costs 0.3."""
PROPOSALS = 2
"""Replacements named for each word."""
MAX_TRIED = 6
"""Replacements tried for each word, about 0.3 s each: a person waits for the answer."""
MAX_EXPLAINED = 4
"""Confused pairs, the worst ones, for which replacements are sought."""
NEAR_NAMES = 5
"""Names tried in place of a name, those with the most phones in common."""


@dataclass(frozen=True)
class Confusion:
    """Two phrases that compete, the voice in which they are most alike, and how often one is heard as the other.

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
    """Whether both are the phrasebook's own: a team cannot reword them, and is not refused for them."""
    sentences: tuple[str, str] = ("", "")
    """Two that differ in these phrases alone; the phrases themselves if no two do."""
    subject: str = ""
    """The one of the two to reword, where one is the team's."""
    key: str = "tasks"
    """The setting that it comes from: `tasks`, `names` or `teams`."""
    proposals: tuple[str, ...] = ()
    """Words to use instead: near in meaning or sound, and tested to pass this check."""
    alternative_of: str = ""
    """The word as which `first` or `second`, an alternative of the task file, counts."""

    @property
    def confusable(self) -> bool:
        """Whether a rate is over its limit."""
        return self.quiet > LIMIT_QUIET or self.at_0_db > LIMIT_NOISE


def describe(confusion: Confusion) -> str:
    """One sentence: which two sentences are mistaken for each other, when, by which words, and the remedy."""
    c = confusion
    when = "even in quiet" if c.quiet > LIMIT_QUIET else "in noise as loud as the voice"
    what = "sound the same" if c.same_sound else f"could be confused {when}"
    remedy = f"reword '{c.subject}'" if c.subject else "reword one of them"
    if c.alternative_of:
        remedy = f"leave the alternative of '{c.alternative_of}' out of the task file"
    elif c.proposals:
        *others, last = (f"'{each}'" for each in c.proposals)
        remedy = f"instead of '{c.subject}' say for example {', '.join(others)}{' or ' * bool(others)}{last}"
    first, second = c.sentences
    by = f", by the words '{c.first}' and '{c.second}'" if c.sentences != (c.first, c.second) else ""
    return f"'{first}' and '{second}' {what}{by}; {remedy}"


def refusal(confusions: Iterable[Confusion], tasks: Path, allowable: bool = True) -> str | None:
    """Why a team's words cannot be used, one line a pair with the place to mend it; None when they can. `tasks` is the
    file of the tasks; `allowable` tells whether the command has --allow-confusable."""
    wrong = [c for c in confusions if c.confusable and not c.fixed]
    lines = []
    for c in wrong:
        words = (c.subject,) if c.subject else (c.first, c.second)
        lines.append(f"{place_of(tasks, *words) if c.key == 'tasks' else c.key}: {describe(c)}")
    return "\n".join([*lines, *["To use them anyway: --allow-confusable"] * (allowable and bool(lines))]) or None


def check(
    book: Phrasebook, names: Iterable[str], sound: Sound, cache: Path | None = None, chosen_only: bool = False
) -> tuple[Confusion, ...]:
    """The pairs of `book` that come near one another in the voices of `names`, worst first.

    With `cache`, a folder, what was found for the same words, voices and program is kept there. `chosen_only`, for a
    quick start, leaves out what no change of a single task, team or robot's name would mend.
    """
    counts_as = {phrase: word for word, phrases in book.alternatives.items() for phrase in phrases}
    pairs = tuple(_pairs(book, sound))
    if chosen_only:
        pairs = tuple(pair for pair in pairs if _is_chosen(*pair) or not counts_as.keys().isdisjoint(pair))
    pairs = tuple(pair for pair in pairs if not _is_same(pair, counts_as))
    voices = tuple({sound.voice_of(name): None for name in names})
    spoken = {word: sound.lexicon.pronunciations(word) for word in book.heard_graph.words}
    content = f"{_recipe()} {counts_as!r} {pairs!r} {voices!r} {sorted(spoken.items())!r}"
    path = cache / (hashlib.sha256(content.encode()).hexdigest()[:32] + ".json") if cache is not None else None
    found = _read(path)
    if found is None:
        found = tuple(_of_alternative(c, counts_as) for c in _find(pairs, voices, sound))
        wrong = [c for c in found if c.confusable and not c.fixed]
        explained = {c: _explained(c, book) for c in wrong}
        explained |= {c: _with_proposals(explained[c], book, pairs, voices, sound) for c in wrong[:MAX_EXPLAINED]}
        found = tuple(explained.get(c, c) for c in found)
        _write(path, found)
    return found


def _pairs(book: Phrasebook, sound: Sound) -> Iterator[Pair]:
    """What can be taken for one another: competing phrases, and commands for what sounds like them, wherever it is."""
    yield from competing_phrases(book.heard_graph)
    own = sorted({*book.heard_graph.words} - FIXED_WORDS)
    said = {word: set(sound.lexicon.sounds(word)) for word in {*own, *SAFETY_WORDS}}
    yield from (((command,), (word,)) for word in own for command in sorted(SAFETY_WORDS) if said[command] & said[word])


def _is_same(pair: Pair, counts_as: Mapping[Phrase, str]) -> bool:
    """Whether both sides of a pair are understood as the same word."""
    first, second = (counts_as.get(phrase, " ".join(phrase)) for phrase in pair)
    return first == second


def _of_alternative(c: Confusion, counts_as: Mapping[Phrase, str]) -> Confusion:
    """An alternative is the team's, whatever words it is made of."""
    words = (counts_as.get(tuple(phrase.split())) for phrase in (c.first, c.second))
    word = next((word for word in words if word is not None), None)
    return c if word is None else replace(c, fixed=False, alternative_of=word)


def _is_chosen(first: Phrase, second: Phrase) -> bool:
    """Whether a team chose a word of both phrases, or the one word that one of them is."""
    chosen = [phrase for phrase in (first, second) if not FIXED_WORDS.issuperset(phrase)]
    return len(chosen) == 2 or any(len(phrase) == 1 for phrase in chosen)


def _find(pairs: Sequence[Pair], voices: Sequence[Voice], sound: Sound) -> tuple[Confusion, ...]:
    """The pairs that come near one another, each in its worst voice, worst first."""
    words = sorted({word for pair in pairs for phrase in pair for word in phrase})
    if not pairs:
        return ()
    worst: dict[Pair, Confusion] = {}
    for voice in voices:
        speaker = sound.speaker_in(voice)
        rendered = {word: speaker.templates(word) for word in words}
        rough = VoiceSounds({word: takes[:1] for word, takes in rendered.items()}, HARDEST, EVERY)
        near = [p for p, d in _distances(rough, pairs).items() if float(d.min()) < FAR]
        for pair, distances in _distances(VoiceSounds(rendered), near).items():
            confusion = judge(pair, voice, distances)
            if pair not in worst or _severity(confusion) > _severity(worst[pair]):
                worst[pair] = confusion
    worst |= {pair: _homophones(pair) for pair in pairs if _may_sound_the_same(pair, sound)}
    return tuple(sorted(worst.values(), key=lambda c: (-_severity(c), c.first, c.second)))


def _may_sound_the_same(pair: Pair, sound: Sound) -> bool:
    """Whether some pronunciation of the one is one of the other: a speaker may choose it, as of "read"."""
    first, second = (set(sound.lexicon.sounds(phrase[0])) for phrase in pair)
    return max(map(len, pair)) == 1 and bool(first & second)


def _homophones(pair: Pair) -> Confusion:
    fixed = all(phrase[0] in FIXED_WORDS for phrase in pair)
    return Confusion(pair[0][0], pair[1][0], "any", True, 0.5, 0.5, 0.5, fixed)


def _severity(confusion: Confusion) -> float:
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
    """Return the confusion that follows from these distances of a pair, shape (len(CONDITIONS),)."""
    rate = ConfusionCurve().rate

    def worst(snr_db: float | None) -> float:
        return max(rate(float(d)) for d, c in zip(distances, CONDITIONS, strict=True) if c.snr_db == snr_db)

    fixed = all(word in FIXED_WORDS for phrase in pair for word in phrase)
    same = float(distances[CONDITIONS.index(Condition())]) < SAME
    rates = (worst(None), worst(0.0), worst(-5.0))
    return Confusion(" ".join(pair[0]), " ".join(pair[1]), voice.name, same, *rates, fixed)


def _explained(c: Confusion, book: Phrasebook) -> Confusion:
    """With two sentences that show it, and the word of the team that is to be another, which is not the article."""
    sides = [tuple(c.first.split()), tuple(c.second.split())]
    c = replace(c, sentences=example_sentences(book, sides[0], sides[1]))
    chosen = [(w, side) for side in sides for w in side if w != "the" and ("the" in side or w not in FIXED_WORDS)]
    if c.alternative_of or not chosen or ARTICLES.issuperset(sides[0] + sides[1]):
        return c
    word, _ = max(chosen, key=lambda each: (-len(each[1]), len(each[0])))
    return replace(c, subject=word, key=_key_of(word, book.vocabulary))


def _with_proposals(
    c: Confusion, book: Phrasebook, pairs: Sequence[Pair], voices: Sequence[Voice], sound: Sound
) -> Confusion:
    """With what to say instead of its subject."""
    proposals: list[str] = []
    wanted = _instead_of(c.subject, c.key, book, sound) if c.subject else ()
    for phrase in islice(wanted, MAX_TRIED):
        if len(proposals) < PROPOSALS and _passes(c.subject, phrase, book, frozenset(pairs), voices, sound):
            proposals.append(" ".join(phrase))
    return replace(c, proposals=tuple(proposals))


def _key_of(word: str, vocabulary: Vocabulary) -> str:
    texts = (*vocabulary.tasks, *vocabulary.remarks, *vocabulary.failures, *vocabulary.places)
    if any(word in spoken_words(text) for text in texts):
        return "tasks"
    return "names" if word in (name.lower() for name in vocabulary.names) else "teams"


def _instead_of(word: str, key: str, book: Phrasebook, sound: Sound) -> Iterator[tuple[str, ...]]:
    """Replacements for a word of the team's, the best first, if their words can be read and are not used."""
    if key == "names":
        known = ((name,) for name in near_names(word, sound.lexicon)[:NEAR_NAMES])
        name = next(each for each in book.vocabulary.names if each.lower() == word)
        found: Iterable[tuple[str, ...]] = (*known, *instead_of_name(name))
    elif key == "teams":
        found = instead_of_team(word)
    else:
        firsts = {spoken_words(task)[0] for task in book.vocabulary.tasks}
        found = instead_of_verb(word) if word in firsts else instead_of_noun(word)
    used = set(book.heard_graph.words) - ({word} if key == "tasks" else set())
    for phrase in found:
        guessed = [each for each in phrase if each != word and sound.lexicon.find(each).origin is Origin.LETTERS]
        if not (key == "tasks" and guessed) and not used & {each.lower() for each in phrase}:
            yield phrase


def _passes(
    word: str, phrase: tuple[str, ...], book: Phrasebook, old: Set[Pair], voices: Sequence[Voice], sound: Sound
) -> bool:
    """Whether nothing new would be confused if the phrase stood in place of the word."""
    try:
        reworded = Phrasebook(_reworded(book.vocabulary, word, " ".join(phrase)))
        new = [pair for pair in _pairs(reworded, sound) if pair not in old or (word,) in pair]
    except PhraseError:
        return False
    fresh = {each.lower() for each in phrase}
    pairs = [pair for pair in new if any(fresh.intersection(side) for side in pair)]
    return not any(c.confusable and not c.fixed for c in _find(pairs, voices, sound))


def _reworded(vocabulary: Vocabulary, word: str, phrase: str) -> Vocabulary:
    """The team's words with the phrase in place of the word, wherever it stands."""

    def changed(text: str) -> str:
        return " ".join(phrase if part.lower() == word else part for part in text.split(" "))

    return replace(
        vocabulary,
        names=tuple(map(changed, vocabulary.names)),
        teams=tuple(map(changed, vocabulary.teams)),
        tasks=tuple(map(changed, vocabulary.tasks)),
        places=tuple(map(changed, vocabulary.places)),
        alternatives=tuple(pair for pair in vocabulary.alternatives if pair[0] != word),
    )


def _recipe() -> str:
    """A digest of the programs that decide, so that cached results of older ones are not reused."""
    folder = Path(__file__).parents[1]
    names = ("templates", "frontend", "decoder")
    others = [folder / "language" / "competition.py", folder / "assembly" / "separation.py"]
    programs = [*others, *(folder / "recognition" / f"{name}.py" for name in names)]
    sources = [Path(__file__), SYNONYMS_PATH, *programs]
    return recipe() + hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()


def as_dict(confusion: Confusion) -> dict[str, object]:
    """For JSON; rates rounded to a hundredth of a percent."""
    return {k: round(v, 4) if isinstance(v, float) else v for k, v in vars(confusion).items()}


def _read(path: Path | None) -> tuple[Confusion, ...] | None:
    """The cached result; None if there is none, or not in this form."""
    if path is None:
        return None
    try:
        return cattrs.structure(json.loads(path.read_text(encoding="utf-8")), tuple[Confusion, ...])
    except (OSError, ValueError, TypeError, cattrs.BaseValidationError):
        return None


def _write(path: Path | None, found: Sequence[Confusion]) -> None:
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps([vars(c) for c in found]).encode())
    except OSError:
        pass  # a full or read-only disk costs time at the next start, no more
