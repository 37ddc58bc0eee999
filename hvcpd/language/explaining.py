"""Explains why words are no sentence of a phrasebook."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.config.names import valid_robot_name
from hvcpd.errors import alike
from hvcpd.language.addressees import GREETING, TO_ALL
from hvcpd.language.automaton import expected_after
from hvcpd.language.graph import WordGraph, ends_of
from hvcpd.language.pattern import Words
from hvcpd.language.variants import as_spoken

_TO_ALL = (GREETING, TO_ALL)


def why_not(readings: Sequence[tuple[Words, WordGraph]], names: Sequence[str]) -> str:
    """Where the words leave the sentences of a network, and what is possible there. Each network has its own reading of
    the words; the one that follows its reading nearest to the end is explained, of equals the first, with what all of
    them have there."""
    followed = [(words, graph, *expected_after(graph, words)) for words, graph in readings]
    words, graph, known, _ = min(followed, key=lambda each: len(each[0]) - each[2])
    if not words:
        return "there is no word to say; `hvcpctl phrases` lists what can be said"
    expected = frozenset[str]().union(*(each[3] for each in followed if each[2] == known and each[0] == words))
    wrong = words[known][:40] if known < len(words) else ""
    written = " ".join(words[:known])
    choices = ", ".join(sorted(expected)[:8]) + (", …" if len(expected) > 8 else "")
    where = f"after '{written}'" if written else "at the beginning"
    if known == len(words):
        shorter = f", or end before '{words[-1]}'" if _is_sentence(graph, words[:-1]) else ""
        return f"the sentence breaks off {where}; it could go on with: {choices}{shorter}"
    close = alike(words[known], expected)
    hint = f"did you mean '{close}'?" if close else f"possible there: {choices or 'nothing, it ends there'}"
    if not close and len(words) > 1 and _may_be_name(words, known, graph, names):
        all_names = ",".join((*names, wrong.capitalize()))
        hint = f"known names are {', '.join(names)}; for a new one give all with --names {all_names}"
    addressed = (words[-1], *words[:-1])
    if known == len(words) - 1 and _is_sentence(graph, addressed):
        hint = f"whom it is for comes first: '{' '.join(addressed)}'"
    elif greeted := _with_greeting(words, known, graph):
        hint = f"{'the greeting' if known else 'whom it is for'} comes first: '{' '.join(greeted)} …'"
    elif opening := _missing_opening(words, known, graph, names):
        hint = f"the speaker comes first: '{' '.join(opening)} …'"
    return f"'{wrong}' is not in the phrasebook {where}; {hint} (all forms: hvcpctl phrases)"


def _may_be_name(words: Words, known: int, graph: WordGraph, names: Sequence[str]) -> bool:
    """Whether the sentence goes on, or ends, with a known name instead of the word after the `known` ones."""
    if words[known] in graph.words or valid_robot_name(words[known]) is not None:
        return False
    named = ((*words[:known], name.lower(), *words[known + 1 : known + 2]) for name in names)
    return any(_follows(graph, told) for told in named)


def _missing_opening(words: Words, known: int, graph: WordGraph, names: Sequence[str]) -> Words:
    """The words up to the speaker's name that were left out before the word after the `known` ones, or none."""
    before = words[:known]
    for who in (before, (GREETING, *before)) if before else (_TO_ALL,):
        opening = (*who, "i", "am")
        sentence = (*opening, *(name.lower() for name in names[:1]), words[known])
        if _follows(graph, sentence):
            return opening
    return ()


def _with_greeting(words: Words, known: int, graph: WordGraph) -> Words:
    """The words to the second after the `known` ones, with the greeting that was left out before them; none if they do
    not begin a sentence so."""
    greeting = (GREETING,) if known else _TO_ALL
    greeted = as_spoken(graph, (*greeting, *words))[: len(greeting) + known + 2]
    return greeted if _follows(graph, greeted) else ()


def _is_sentence(graph: WordGraph, words: Words) -> bool:
    return not graph.finals.isdisjoint(ends_of(graph, graph.start, words))


def _follows(graph: WordGraph, words: Words) -> bool:
    """Whether these words are a sentence, or its beginning."""
    return expected_after(graph, words)[0] == len(words)
