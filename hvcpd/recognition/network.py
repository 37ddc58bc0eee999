"""The word network and its templates compiled into one vector of states for the decoder.

Each voice has its own copy of the word graph, because one speaker utters the whole sentence. Each arc of a copy
holds, for every template of its word, a chain of states, one a frame. Two virtual states stand before each chain:
the first is never reachable, the second is where the sentence enters, so that the decoder's steps need no special
case at the beginning of a word.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import WordGraph
from hvcpd.recognition.templates import TemplateBank

VIRTUAL_STATES = 2
Index = NDArray[np.intp]


class Network:
    """Arrays that describe the compiled network; none changes after construction.

    States (n_states): `frame_of_state`, row of the template bank (n_frames for virtual states).
    Chains (n_chains, sorted by target node): `entry_state`, `last_state`, `source_node`, `target_node`, `word`,
    `template`. Nodes (n_nodes): `may_pause`, `is_final`; `start_nodes` lists one node per voice.
    `reached_nodes` are the targets of `target_node` once each, `group_starts` where each one's chains begin,
    `group_of_chain` which of them a chain leads to.
    """

    def __init__(self, graph: WordGraph, bank: TemplateBank) -> None:
        """Raises ValueError for a word of the graph that a voice has no template of."""
        self.voices = tuple(dict.fromkeys(t.voice for t in bank.templates))
        by_word: dict[tuple[str, str], list[int]] = {}
        for number, t in enumerate(bank.templates):
            by_word.setdefault((t.voice, t.word), []).append(number)
        chains: list[tuple[int, int, str, int]] = []
        for v, voice in enumerate(self.voices):
            base = v * graph.n_nodes
            missing = [word for word in graph.words if (voice, word) not in by_word]
            if missing:
                raise ValueError(f"voice {voice!r} has no template of: {', '.join(missing)}")
            for arc in graph.arcs:
                for number in by_word[voice, arc.word]:
                    chains.append((base + arc.target, base + arc.source, arc.word, number))
        chains.sort()
        self._lay_out_nodes(graph)
        self._lay_out_chains(chains, bank)

    def _lay_out_nodes(self, graph: WordGraph) -> None:
        self.nodes_per_voice = graph.n_nodes
        self.n_nodes = graph.n_nodes * len(self.voices)
        bases = np.arange(len(self.voices)) * graph.n_nodes
        self.start_nodes: Index = bases + graph.start
        self.is_final = np.zeros(self.n_nodes, np.bool_)
        self.may_pause = np.zeros(self.n_nodes, np.bool_)
        for base in bases:
            self.is_final[[base + node for node in graph.finals]] = True
            self.may_pause[[base + node for node in graph.pauses if node != graph.start]] = True

    def _lay_out_chains(self, chains: list[tuple[int, int, str, int]], bank: TemplateBank) -> None:
        self.n_chains = len(chains)
        self.target_node: Index = np.array([c[0] for c in chains], np.intp)
        self.source_node: Index = np.array([c[1] for c in chains], np.intp)
        self.word = tuple(c[2] for c in chains)
        self.template: Index = np.array([c[3] for c in chains], np.intp)
        lengths = np.array([bank.templates[c[3]].length for c in chains])
        firsts = np.array([bank.templates[c[3]].first for c in chains])
        ends = np.cumsum(lengths + VIRTUAL_STATES)
        begins = ends - lengths - VIRTUAL_STATES
        self.n_states = int(ends[-1])
        self.entry_state: Index = begins + VIRTUAL_STATES - 1
        self.last_state: Index = ends - 1
        self.frame_of_state: Index = np.full(self.n_states, bank.n_frames, np.intp)
        for begin, end, first, length in zip(begins, ends, firsts, lengths, strict=True):
            self.frame_of_state[begin + VIRTUAL_STATES : end] = np.arange(first, first + length)
        self.reached_nodes, self.group_starts, self.group_of_chain = np.unique(
            self.target_node, return_index=True, return_inverse=True
        )

    def voice_of_node(self, node: int) -> str:
        """The voice whose copy of the graph holds `node`."""
        return self.voices[node // self.nodes_per_voice]
