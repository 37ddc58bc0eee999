"""The word network: every sentence that the phrasebook can make, as a finite-state acceptor over words.

It is what `language` hands to `recognition`; neither needs to know more of the other.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Arc:
    """One word spoken on the way from node `source` to node `target`."""

    source: int
    target: int
    word: str


@dataclass(frozen=True)
class WordGraph:
    """A finite-state network of words; deterministic: no node has two arcs of the same word.

    Sentences are the words along the paths from `start` to any node in `finals`. A speaker may pause at the
    nodes in `pauses` (the commas of the written sentence); elsewhere words follow each other closely.
    """

    n_nodes: int
    arcs: tuple[Arc, ...]
    start: int
    finals: frozenset[int]
    pauses: frozenset[int]

    @property
    def words(self) -> tuple[str, ...]:
        """Every word of the network once, sorted."""
        return tuple(sorted({arc.word for arc in self.arcs}))
