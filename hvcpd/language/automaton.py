"""From patterns to the word network: Thompson's construction, then subsets, then merging of equal tails.

Both are textbook (Hopcroft & Ullman 1979, §2); the language is finite, so equal tails are found from the ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.language.pattern import COMMA, LETTERS_SLOT, Choice, Node, Pause, Series, Slot, SlotValues, Word
from hvcpd.language.spelling import ANY_LETTERS, with_letters


@dataclass
class _Nfa:
    """`steps[state]` are (word, state) pairs, `free[state]` are (state, is_pause) moves without a word."""

    steps: list[list[tuple[str, int]]] = field(default_factory=list)
    free: list[list[tuple[int, bool]]] = field(default_factory=list)

    def state(self) -> int:
        self.steps.append([])
        self.free.append([])
        return len(self.steps) - 1

    def add(self, node: Node, source: int, slots: SlotValues) -> int:
        """Append a pattern after state `source`; returns the state after it."""
        match node:
            case Word(text):
                return self._words((text,), source)
            case Pause():
                return self._words((COMMA,), source)
            case Series(parts):
                for part in parts:
                    source = self.add(part, source, slots)
                return source
            case Slot(name) if name == LETTERS_SLOT:
                return self._words((ANY_LETTERS,), source)
            case Slot(name):
                ends = [self._words(words, source) for words in slots.get(name, {}).values()]
            case Choice(options):
                ends = [self.add(option, source, slots) for option in options]
        join = self.state()
        for end in ends:
            self.free[end].append((join, False))
        return join

    def _words(self, words: Sequence[str], source: int) -> int:
        for word in words:
            target = self.state()
            if word == COMMA:
                self.free[source].append((target, True))
            else:
                self.steps[source].append((word, target))
            source = target
        return source

    def closure(self, states: frozenset[int]) -> tuple[frozenset[int], bool]:
        """All states reachable without a word, and whether a pause lies on the way to one of them."""
        seen, todo, pause = set(states), list(states), False
        while todo:
            for target, is_pause in self.free[todo.pop()]:
                pause = pause or is_pause
                if target not in seen:
                    seen.add(target)
                    todo.append(target)
        return frozenset(seen), pause


@dataclass
class _Subsets:
    """The network's nodes for sets of the automaton's states, which end a sentence in `ends`."""

    nfa: _Nfa
    ends: set[int]
    nodes: dict[frozenset[int], int] = field(default_factory=dict)
    merged: dict[tuple[object, ...], int] = field(default_factory=dict)
    arcs: list[Arc] = field(default_factory=list)
    finals: set[int] = field(default_factory=set)
    pauses: set[int] = field(default_factory=set)

    def visit(self, states: frozenset[int]) -> int | None:
        """The network's node for a set of states; None where no sentence can end from here."""
        if states in self.nodes:
            return self.nodes[states]
        closed, pause = self.nfa.closure(states)
        following: dict[str, set[int]] = {}
        for state in closed:
            for word, target in self.nfa.steps[state]:
                following.setdefault(word, set()).add(target)
        out = [(word, self.visit(frozenset(targets))) for word, targets in sorted(following.items())]
        live = tuple((word, target) for word, target in out if target is not None)
        final = bool(closed & self.ends)
        if not live and not final:
            return None
        signature = (live, final, pause)
        if signature not in self.merged:
            node = self.merged[signature] = len(self.merged)
            self.arcs.extend(Arc(node, target, word) for word, target in live)
            if final:
                self.finals.add(node)
            if pause and live:
                self.pauses.add(node)
        self.nodes[states] = self.merged[signature]
        return self.nodes[states]


def build_graph(patterns: Sequence[Node], slots: SlotValues) -> WordGraph:
    """The minimal deterministic network of all sentences of the patterns."""
    nfa = _Nfa()
    start = nfa.state()
    ends = {nfa.add(pattern, start, slots) for pattern in patterns}
    found = _Subsets(nfa, ends)
    root = found.visit(frozenset({start}))
    if root is None:
        raise ValueError("the patterns make no sentence")
    finals, pauses = frozenset(found.finals), frozenset(found.pauses)
    return with_letters(WordGraph(len(found.merged), tuple(found.arcs), root, finals, pauses))


def expected_after(graph: WordGraph, words: Sequence[str]) -> tuple[int, frozenset[str]]:
    """The number of words that the network can follow, and the possible next words."""
    node = graph.start
    for count, word in enumerate(words):
        following = dict(graph.following[node])
        if word not in following:
            return count, frozenset(following)
        node = following[word]
    return len(words), frozenset(dict(graph.following[node]))
