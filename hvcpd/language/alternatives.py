"""Phrases that count as a word of the phrasebook when they are heard, and are never said."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping

from hvcpd.errors import VocabularyError
from hvcpd.language.graph import WordGraph, ends_of
from hvcpd.language.pattern import Words


def by_word(pairs: Iterable[tuple[str, str]]) -> dict[str, tuple[Words, ...]]:
    """The phrases of each word, in spoken words."""
    found: dict[str, tuple[Words, ...]] = {}
    for word, phrase in pairs:
        found[word] = (*found.get(word, ()), tuple(phrase.split()))
    return found


def refuse_senseless(graph: WordGraph, alternatives: Mapping[str, tuple[Words, ...]]) -> None:
    """Raises VocabularyError for an alternative of no word of the network, or one that can be said in its place."""
    for word, phrases in alternatives.items():
        places = {arc.source for arc in graph.arcs if arc.word == word}
        if not places:
            close = difflib.get_close_matches(word, graph.words, n=1)
            hint = f"did you mean '{close[0]}'?" if close else "leave it out (all words: hvcpctl phrases)"
            raise VocabularyError(f"alternatives: '{word}' is no word of the phrasebook; {hint}", "tasks")
        for phrase in phrases:
            if any(ends_of(graph, place, phrase) for place in places):
                text = f"'{' '.join(phrase)}' cannot count as '{word}', for it can be said itself in that place"
                raise VocabularyError(f"alternatives: {text}; leave it out", "tasks")
