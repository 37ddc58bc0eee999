"""The word network and its templates compiled into word instances for the decoder.

Each voice has its own copy of the word graph, because one speaker utters the whole sentence. Each arc of a copy
holds, for every template of its word, a word instance, a row of states, one a frame.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import WordGraph
from hvcpd.recognition.templates import Template

Index = NDArray[np.intp]


class Network:
    """Arrays that describe the compiled network; none changes after construction.

    Instances (n_instances, sorted by target node): `first_row` and `length`, their frames in the template bank
    (`longest` is the longest one's); `word_shortest` and `word_longest`, frames of all takes of its word in its voice;
    `source_node`, `target_node`; `word` and `word_number` (equal words have equal numbers).
    Nodes (n_nodes): `may_pause`, `is_final`, `goes_on` (words may follow); `start_nodes` lists one node per voice.
    """

    def __init__(self, graph: WordGraph, templates: Sequence[Template], partial: bool = False) -> None:
        """Raises ValueError if a voice lacks a template of a word of the graph, unless `partial`: then a voice says
        only the sentences for which it has all words."""
        self.voices = tuple(dict.fromkeys(t.voice for t in templates))
        by_word: dict[tuple[str, str], list[int]] = {}
        for number, t in enumerate(templates):
            by_word.setdefault((t.voice, t.word), []).append(number)
        instances: list[tuple[int, int, str, int]] = []
        for v, voice in enumerate(self.voices):
            base = v * graph.n_nodes
            missing = [word for word in graph.words if (voice, word) not in by_word]
            if missing and not partial:
                raise ValueError(f"voice {voice!r} has no template of: {', '.join(missing)}")
            for arc in graph.arcs:
                for number in by_word.get((voice, arc.word), ()):
                    instances.append((base + arc.target, base + arc.source, arc.word, number))
        instances.sort()
        self._lay_out_nodes(graph)
        self._lay_out_instances(instances, templates)
        takes = [by_word[templates[c[3]].voice, c[2]] for c in instances]
        lengths = [[templates[number].length for number in numbers] for numbers in takes]
        self.word_shortest: Index = np.array([min(each) for each in lengths], np.intp)
        self.word_longest: Index = np.array([max(each) for each in lengths], np.intp)

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

    def _lay_out_instances(self, instances: list[tuple[int, int, str, int]], templates: Sequence[Template]) -> None:
        self.n_instances = len(instances)
        self.goes_on = np.zeros(self.n_nodes, np.bool_)
        self.goes_on[[c[1] for c in instances]] = True
        self.target_node: Index = np.array([c[0] for c in instances], np.intp)
        self.source_node: Index = np.array([c[1] for c in instances], np.intp)
        self.word = tuple(c[2] for c in instances)
        numbers = {word: number for number, word in enumerate(dict.fromkeys(self.word))}
        self.word_number: Index = np.array([numbers[word] for word in self.word], np.intp)
        self.length: Index = np.array([templates[c[3]].length for c in instances], np.intp)
        self.longest = int(self.length.max())
        self.first_row: Index = np.array([templates[c[3]].first for c in instances], np.intp)

    def voice_of_node(self, node: int) -> str:
        """The voice whose copy of the graph holds `node`."""
        return self.voices[node // self.nodes_per_voice]
