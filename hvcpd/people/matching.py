"""Matches a whole piece of sound with the sentences that can be made of the takes of words that there are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hvcpd.language.graph import WordGraph, graph_of
from hvcpd.people.chains import FAR, Chains, Costs, Ends
from hvcpd.recognition.frontend import CONTEXT_FRAMES, Energies, Features, features_of
from hvcpd.recognition.network import Index, Network
from hvcpd.recognition.scorer import Scorer, norms_of, squared_distances
from hvcpd.recognition.templates import Noise, TemplateBank, noise_features

VOTE_COST = 10.0
"""Voices vote on a sentence with weights that fall by e for this much more distance in all. Digits of people, templates
of three others: 158 of 200 right, by the nearest voice alone 141; the speaker's own among them: 79 of 80, as alone."""
LEAST_GAIN = 1e-9


@dataclass(frozen=True)
class MatchedWord:
    """A word, its frames `start` up to `end` of the piece, and how it fits.

    `deficit`: the mean distance of a frame to the take beyond that to the nearest frame of all takes. `margin`: how
    much more the cheapest other word costs that leads to the same place at the same time.
    """

    word: str
    start: int
    end: int
    deficit: float
    margin: float


@dataclass(frozen=True)
class Match:
    """The sentence that fits best, and in whose voice.

    `passed_over`: the mean distance of a frame outside the words to the room's noise, beyond that to the nearest frame
    of all takes: high where speech is taken for noise. `above_noise`: how much farther a frame of the words is from the
    noise than from the takes, in the mean: near 0 where words are taken for what cannot be heard.
    """

    voice: str
    words: tuple[MatchedWord, ...]
    passed_over: float
    above_noise: float


@dataclass(frozen=True, eq=False)
class _Heard:
    """Features of a piece and of all template frames, and the distance of each frame of the piece to the noise."""

    features: Features
    rows: Features
    to_noise: Costs

    def to(self, rows: Index) -> Callable[[int, int], Costs]:
        """Distances of some frames to some template frames."""
        some = self.rows if len(rows) == len(self.rows) else self.rows[rows]
        norms = norms_of(some)
        return lambda begin, end: _distances(self.features[begin:end], some, norms)


class Matcher:
    """Knows takes of words in one or more voices, and a network of sentences."""

    def __init__(self, graph: WordGraph, takes: Mapping[str, Mapping[str, Sequence[Energies]]]) -> None:
        """`takes[voice][word]`: without noise. A voice need not have all words. Raises ValueError without takes."""
        self._bank = TemplateBank(takes)
        self._scorer = Scorer(self._bank, (0.0,))
        self._voices = frozenset(takes)
        self._chains = self._compiled(graph)

    def _compiled(self, graph: WordGraph) -> Chains:
        return Chains(Network(graph, self._bank, partial=self._voices))

    def match(self, energies: Energies, noise: Noise) -> Match | None:
        """The sentence in a piece of sound, of whose noise the mean energies, shape (N_BANDS,), are known.

        `energies`, shape (n, N_BANDS), begin and end with a little noise. None if it is too short for any sentence.
        """
        heard = self._heard(energies, noise)
        ends = self._chains.forward(heard.to(self._chains.rows), heard.to_noise)
        found = _best_of_voices(self._chains, ends)
        if not found:
            return None
        sentences = dict.fromkeys(words for _, words, _ in found.values())
        if len(sentences) == 1:
            return self._match(self._chains, ends, min(found.values())[2], heard, ends.nearest)
        return self._voted(sentences, heard, ends.nearest)

    def _heard(self, energies: Energies, noise: Noise) -> _Heard:
        gain = max(self._scorer.level_of(energies, noise), LEAST_GAIN)
        mask = self._scorer.mask(gain)
        rows = self._bank.compose(np.arange(self._bank.n_frames), noise + mask, gain)
        padded = np.pad(energies + mask, ((CONTEXT_FRAMES, CONTEXT_FRAMES), (0, 0)), mode="edge")
        heard = features_of(padded)
        silence = noise_features(noise + mask)[None, :]
        to_noise = _distances(heard, silence, norms_of(silence))[:, 0]
        return _Heard(heard, rows, to_noise)

    def _voted(self, sentences: Iterable[tuple[str, ...]], heard: _Heard, nearest: Costs) -> Match:
        """Of the sentences that fit best in one voice or another, the one that fits best in all; in its best voice."""
        judged = []
        for words in sentences:
            chains = self._compiled(graph_of(words))
            ends = chains.forward(heard.to(chains.rows), heard.to_noise)
            voices = _best_of_voices(chains, ends).values()
            costs = np.array([cost for cost, _, _ in voices])
            vote = costs.min() - VOTE_COST * float(np.log(np.exp((costs.min() - costs) / VOTE_COST).sum()))
            judged.append((vote, words, chains, ends, min(voices)[2]))
        _, _, chains, ends, node = min(judged, key=lambda each: each[:2])
        return self._match(chains, ends, node, heard, nearest)

    def _match(self, chains: Chains, ends: Ends, node: int, heard: _Heard, nearest: Costs) -> Match:
        words, inside = [], np.zeros(len(heard.to_noise), np.bool_)
        least = np.minimum(nearest, heard.to_noise)
        path = chains.trace(ends, node)
        for word in path:
            excess = word.cost - float(least[word.start : word.end].sum())
            deficit = excess / (word.end - word.start)
            words.append(MatchedWord(chains.net.word[word.chain], word.start, word.end, deficit, word.margin))
            inside[word.start : word.end] = True
        beyond = (heard.to_noise - least)[~inside]
        passed_over = float(beyond.mean()) if len(beyond) else 0.0
        inside_noise = float(heard.to_noise[inside].sum()) - sum(word.cost for word in path)
        return Match(
            chains.net.voice_of_node(node), tuple(words), passed_over, inside_noise / max(int(inside.sum()), 1)
        )


def _best_of_voices(chains: Chains, ends: Ends) -> dict[str, tuple[float, tuple[str, ...], int]]:
    """For each voice that has a sentence: the least cost, the words, and the node where they end."""
    net, found = chains.net, {}
    for number, voice in enumerate(net.voices):
        nodes = np.arange(number * net.nodes_per_voice, (number + 1) * net.nodes_per_voice)
        costs = np.where(net.is_final[nodes], ends.rest[-1, nodes], FAR)
        node = int(nodes[costs.argmin()])
        if costs.min() < FAR / 2:
            words = tuple(net.word[word.chain] for word in chains.trace(ends, node))
            found[voice] = (float(costs.min()), words, node)
    return found


def _distances(heard: Features, rows: Features, norms: Costs) -> Costs:
    """Euclidean distances, shape (len(heard), len(rows)), the rows' squared norms being known."""
    squares = squared_distances(heard, rows, norms, norms_of(heard))
    out: Costs = np.sqrt(squares, out=squares)
    return out
