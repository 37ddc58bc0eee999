"""What may follow a sentence to prove who said it: a seal of code words, or a one-time code.

Which sentences carry one is decided here alone: those that change what a robot does or believes. Greetings, questions
and "stop" never do: whoever sees a robot run into something has no time for proofs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hvcpd.language import messages as m
from hvcpd.language.code_words import CODE_WORDS, number_of, words_of
from hvcpd.language.forms import OPENING, Form
from hvcpd.language.graph import Arc, WordGraph
from hvcpd.language.pattern import Choice, Node, Pause, Series, Word
from hvcpd.language.words import number_words

SEAL_WORDS = 4
"""24 bits: what a guess is worth then is in docs/security.md; each word more costs half a second of every sentence."""
CODE_DIGITS = 6
CODE_CALL = "code"
"""The word before the digits."""
_DIGIT_OF = {number_words(digit)[0]: str(digit) for digit in range(10)}

SEALED = (
    m.Claim,
    m.Working,
    m.Order,
    m.Completed,
    m.Failed,
    m.Confirmed,
    m.Negative,
    m.Unable,
    m.Unknown,
    m.Busy,
    m.Left,
    m.Leaving,
    m.Stopped,
    m.NameTaken,
    m.Resume,
    m.ComeBack,
    m.MoveBy,
    m.TurnBy,
    m.SayAgain,
)
"""Statements that are sealed where a key is set, themselves or passed on. Of these only SayAgain is heeded without: its
seal is a challenge to whoever says something again."""

ANY_SEAL, ANY_CODE = "SEAL", "CODE"
"""Stand in a network for a seal and for a code: `with_marks` puts them there. No word is in capitals."""


def is_sealed(statement: m.Statement | None) -> bool:
    """Whether a statement is one of SEALED, or passes one on."""
    return isinstance(m.own_words(statement), SEALED)


def mark_words(mark: m.Mark) -> tuple[str, ...]:
    """How a mark is said."""
    if isinstance(mark, m.Seal):
        return words_of(mark.value, SEAL_WORDS)
    return (CODE_CALL, *(number_words(int(digit))[0] for digit in mark.digits))


def split_mark(words: Sequence[str]) -> tuple[tuple[str, ...], m.Mark | None]:
    """The sentence without the mark at its end, and the mark, if there is one."""
    sentence, last = tuple(words[:-SEAL_WORDS]), words[-SEAL_WORDS:]
    value = number_of(last) if len(last) == SEAL_WORDS else None
    if value is not None:
        return sentence, m.Seal(value)
    call, digits = words[-CODE_DIGITS - 1 : -CODE_DIGITS], words[-CODE_DIGITS:]
    if list(call) == [CODE_CALL] and all(word in _DIGIT_OF for word in digits):
        return tuple(words[: -CODE_DIGITS - 1]), m.Code("".join(_DIGIT_OF[word] for word in digits))
    return tuple(words), None


def without_mark(utterance: m.Utterance) -> m.Utterance:
    """What is sealed."""
    return replace(utterance, mark=None)


def markable(form: Form, node: Node) -> Node:
    """The pattern `node` of a form with the marks that may follow it; who gives no name can have no seal."""
    if form.statement not in SEALED or form.will:
        return node
    marks = (ANY_SEAL, ANY_CODE) if form.pattern.startswith(OPENING) else (ANY_CODE,)
    follow = tuple(Series((Pause(), Word(mark))) for mark in marks)
    return Series((node, Choice((Series(()), *follow))))


def with_marks(graph: WordGraph) -> WordGraph:
    """The network with all seals in place of each arc ANY_SEAL, and all codes in place of each ANY_CODE.

    They are said after a pause. All seals share their words but the first, and all codes.
    """
    fillers = {ANY_SEAL: [CODE_WORDS] * SEAL_WORDS, ANY_CODE: [(CODE_CALL,), *[tuple(_DIGIT_OF)] * CODE_DIGITS]}
    arcs = [arc for arc in graph.arcs if arc.word not in fillers]
    pauses, n_nodes = set(graph.pauses), graph.n_nodes
    chains: dict[tuple[str, int], int] = {}
    for place in (arc for arc in graph.arcs if arc.word in fillers):
        first, *rest = fillers[place.word]
        key = (place.word, place.target)
        if key not in chains:
            chains[key] = n_nodes
            nodes = [*range(n_nodes, n_nodes + len(rest)), place.target]
            n_nodes += len(rest)
            steps = zip(nodes[:-1], nodes[1:], rest, strict=True)
            arcs += [Arc(a, b, word) for a, b, choice in steps for word in choice]
        arcs += [Arc(place.source, chains[key], word) for word in first]
        pauses.add(place.source)
    return replace(graph, n_nodes=n_nodes, arcs=tuple(arcs), pauses=frozenset(pauses))
