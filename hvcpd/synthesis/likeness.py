"""Which words are too much alike to be told apart, judged by their phones alone.

A weighted edit distance over ARPAbet phones; the weights follow the confusions of Miller & Nicely (1955) for
consonants (place of articulation is lost first, then voicing) and neighbourhood in the vowel quadrilateral.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import chain, islice, product
from pathlib import Path

from hvcpd.config.names import Accent, NameCheck
from hvcpd.errors import ConfigError
from hvcpd.language.clashes import RESERVED_WORDS
from hvcpd.language.rewording import known_names
from hvcpd.synthesis.lexicon import Lexicon

_SIMILAR_CONSONANTS = "P T K, B D G, F TH S, V DH Z, M N NG, S SH, Z ZH, CH JH, P B, T TT D DD, K G, F V, S Z, L W, R W"
_SIMILAR_VOWELS = (
    "IY IH EY, EH AE AH, AA AO AH, UW UH, OW AO, ER AH, AY AA, AW AA, OY AO, IH EH, OH AA AH, OH AO:, AX: ER AH, "
    "AX: EH:, EH EH:, AXW UH, AXW AX:, IA IY IH, IA EH:"
)
SIMILAR_COST = 0.4
"""Of one phone in place of a similar one; another phone, a missing or an additional one costs 1."""
ALIKE_BELOW = 1.0
"""Phrases nearer than one whole phone are alike: robots and people would mix them up in noise."""


def _pairs() -> frozenset[frozenset[str]]:
    groups = [group.split() for group in f"{_SIMILAR_CONSONANTS}, {_SIMILAR_VOWELS}".split(", ")]
    return frozenset(frozenset(pair) for group in groups for pair in product(group, group) if pair[0] != pair[1])


_SIMILAR = _pairs()


def _cost(a: str, b: str) -> float:
    if a == b:
        return 0.0
    return SIMILAR_COST if frozenset((a, b)) in _SIMILAR else 1.0


def phone_distance(a: Sequence[str], b: Sequence[str]) -> float:
    """The least cost to turn one phone sequence into the other; stress digits are ignored (Wagner & Fischer 1974)."""
    left = [phone.rstrip("012") for phone in a]
    right = [phone.rstrip("012") for phone in b]
    row = [float(j) for j in range(len(right) + 1)]
    for i, phone in enumerate(left, start=1):
        previous, row = row, [float(i)]
        for j, other in enumerate(right, start=1):
            row.append(min(previous[j] + 1.0, row[j - 1] + 1.0, previous[j - 1] + _cost(phone, other)))
    return row[-1]


def sounds_alike(a: str, b: str, lexicon: Lexicon) -> bool:
    """Whether two written phrases would be mixed up, in any of their words' pronunciations."""
    return any(
        len(left) == len(right) and phone_distance(left, right) < ALIKE_BELOW  # a phone more or less costs 1
        for left, right in product(_spoken(a, lexicon), _spoken(b, lexicon))
    )


PROPOSALS = 3
"""Number of names that are proposed in place of one."""


def name_fault(name: str, lexicon: Lexicon | None = None) -> str | None:
    """What is wrong with a robot's name beside the phrasebook's own words, with names to take instead; or None."""
    lexicon = lexicon or Lexicon.load()
    word = _reserved_word_like(name, lexicon)
    if word is None:
        return None
    free = (other for other in near_names(name, lexicon) if _reserved_word_like(other, lexicon) is None)
    *others, last = islice(free, PROPOSALS)
    remedy = f"take for example {', '.join(others)} or {last}"
    return f"the name {name!r} sounds like the phrasebook's word {word!r}; {remedy}"


def name_check(lexicon: Path | None, accent: Accent) -> NameCheck:
    """`name_fault` by the pronunciations of these settings. A file that has faults, which are told where it is used,
    does not count."""
    try:
        known = Lexicon.load(lexicon, accent)
    except ConfigError:
        known = Lexicon.load(None, accent)
    return partial(name_fault, lexicon=known)


def near_names(name: str, lexicon: Lexicon) -> list[str]:
    """Names of people, those that sound most like this one first."""
    sounds = lexicon.pronounce(name)
    return sorted(known_names(), key=lambda other: phone_distance(lexicon.pronounce(other), sounds))


def _reserved_word_like(name: str, lexicon: Lexicon) -> str | None:
    words = sorted(RESERVED_WORDS)
    return next((word for word in words if name.lower() == word or sounds_alike(name, word, lexicon)), None)


MAX_VARIANTS = 8
"""Pronunciations of a phrase that are tried; words with two are rare, phrases with four such words hardly exist."""


def _spoken(phrase: str, lexicon: Lexicon) -> list[tuple[str, ...]]:
    variants = product(*map(lexicon.pronunciations, phrase.split()))
    return [tuple(chain.from_iterable(said)) for said in islice(variants, MAX_VARIANTS)]
