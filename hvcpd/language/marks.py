"""Marks of a sentence that prove who said it: a seal of code words, a one-time code, or the sentence encrypted.

This module alone decides which sentences carry one: those that change a robot's actions or beliefs. Greetings,
questions and "stop" never do: a person who sees a robot about to run into something has no time for proofs. All
sentences are encrypted except greetings, spelled names, "stop", measured intervals, and "I do not trust that".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hvcpd.language import messages as m
from hvcpd.language.forms import OPENING, Form
from hvcpd.language.graph import Arc, WordGraph
from hvcpd.language.pattern import Choice, Node, Pause, Series, Word
from hvcpd.language.spelling import CODE_WORDS, number_of, words_of
from hvcpd.language.words import number_words

SEAL_WORDS = 4
"""24 bits: docs/security.md has the value of a guess; each further word costs half a second of every sentence."""
CODE_DIGITS = 6
CIPHER_TAG_BYTES = 4
"""Of an encrypted statement: the shortest tag that AES-CCM has (NIST SP 800-38C, 5.4). A guess is worth 2^8 times less
than a seal's."""
CODE_CALL = "code"
"""The word before the digits."""
CIPHER_CALL = ("sealed", "message")
"""The words before a statement's code words."""
_DIGIT_OF = {number_words(digit)[0]: str(digit) for digit in range(10)}

SEALED = (
    m.Claim,
    m.Working,
    m.Order,
    m.Completed,
    m.Failed,
    m.Change,
    m.PlaceWanted,
    m.PlaceGiven,
    m.PlaceTaken,
    m.PlaceFree,
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
"""Statements that are sealed where a key is set, themselves or passed on. Of these only SayAgain is accepted without a
seal: its seal is a challenge to the robot that repeats its sentence."""

NEVER_HIDDEN = (m.Stop, m.Spelled, m.Distrusted, m.SealedMessage, m.Measured)
"""Statements that stay plain even where all others are encrypted; so do greetings. The 10,000 intervals would make
every encrypted sentence longer, and tell nothing to listeners who do not know the other interval."""

ANY_SEAL, ANY_CODE, ANY_CIPHER = "SEAL", "CODE", "CIPHER"
"""Stand in a network for a seal, a code and a cipher: `with_marks` puts them there. No word is in capitals."""


def is_sealed(statement: m.Statement | None) -> bool:
    """Whether a statement is one of SEALED, or passes one on."""
    return isinstance(m.own_words(statement), SEALED)


def mark_words(mark: m.Mark) -> tuple[str, ...]:
    """The spoken form of a mark."""
    match mark:
        case m.Seal(value):
            return words_of(value, SEAL_WORDS)
        case m.Cipher(value, n_words):
            return words_of(value, n_words)
        case m.Code(digits):
            return (CODE_CALL, *(number_words(int(digit))[0] for digit in digits))


def split_mark(words: Sequence[str]) -> tuple[tuple[str, ...], m.Mark | None]:
    """The sentence without the mark at its end, and the mark, if there is one."""
    call = next((i for i in range(len(words) - 1) if tuple(words[i : i + 2]) == CIPHER_CALL), len(words))
    ciphered = words[call + len(CIPHER_CALL) :]
    value = number_of(ciphered) if len(ciphered) > SEAL_WORDS else None  # a task may end in "message", too
    if value is not None:
        return tuple(words[: call + len(CIPHER_CALL)]), m.Cipher(value, len(ciphered))
    sentence, last = tuple(words[:-SEAL_WORDS]), words[-SEAL_WORDS:]
    value = number_of(last) if len(last) == SEAL_WORDS else None
    if value is not None:
        return sentence, m.Seal(value)
    code_call, digits = words[-CODE_DIGITS - 1 : -CODE_DIGITS], words[-CODE_DIGITS:]
    if list(code_call) == [CODE_CALL] and all(word in _DIGIT_OF for word in digits):
        return tuple(words[: -CODE_DIGITS - 1]), m.Code("".join(_DIGIT_OF[word] for word in digits))
    return tuple(words), None


def without_mark(utterance: m.Utterance) -> m.Utterance:
    """The same, without its proof."""
    return replace(utterance, mark=None)


def hidden(utterance: m.Utterance) -> m.Utterance:
    """Return the utterance as listeners without a key hear it: "sealed message" in place of the encrypted statement."""
    if not isinstance(utterance.mark, m.Cipher):
        return utterance
    return with_statement(utterance, m.SealedMessage())


def with_statement(utterance: m.Utterance, statement: m.Statement) -> m.Utterance:
    """Return the utterance with another statement, passed on from the speaker of the first."""
    if isinstance(utterance.statement, m.Relayed):
        statement = m.Relayed(utterance.statement.speaker, statement)
    return replace(utterance, statement=statement)


def markable(form: Form, node: Node, encrypts: bool) -> Node:
    """The pattern `node` of a form with the marks that may follow it; a speaker without a name can have no seal.

    Where a team `encrypts`, code words must follow "sealed message".
    """
    if encrypts and form.statement is m.SealedMessage:
        return Series((node, Pause(), Word(ANY_CIPHER)))
    if form.statement not in SEALED or form.will:
        return node
    marks = (ANY_SEAL, ANY_CODE) if form.pattern.startswith(OPENING) else (ANY_CODE,)
    follow = tuple(Series((Pause(), Word(mark))) for mark in marks)
    return Series((node, Choice((Series(()), *follow))))


def with_marks(graph: WordGraph, cipher_words: int) -> WordGraph:
    """The network with all seals in place of each arc ANY_SEAL, all codes in place of each ANY_CODE, and all ciphers
    of `cipher_words` in place of each ANY_CIPHER.

    They are said after a pause. All seals share their words but the first; so do all codes, and all ciphers.
    """
    fillers: dict[str, list[tuple[str, ...]]] = {
        ANY_SEAL: [CODE_WORDS] * SEAL_WORDS,
        ANY_CODE: [(CODE_CALL,), *[tuple(_DIGIT_OF)] * CODE_DIGITS],
        ANY_CIPHER: [CODE_WORDS] * cipher_words,
    }
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
