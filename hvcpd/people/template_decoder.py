"""Matches a whole segment of sound with the sentences that the available takes of words can form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hvcpd.language.graph import WordGraph, graph_of
from hvcpd.people.dtw import FAR, Costs, Ends, OnePassDtw, Word
from hvcpd.recognition.frontend import Features
from hvcpd.recognition.network import Network
from hvcpd.recognition.scorer import distances, norms_of
from hvcpd.recognition.templates import Template

VOTE_COST = 10.0
"""Voices vote on a sentence with weights that fall by e for this much more distance in all. Digits of people, templates
of three others: 158 of 200 right, by the nearest voice alone 141; the speaker's own among them: 79 of 80, as alone."""


@dataclass(frozen=True)
class MatchedWord:
    """A word, its frames `start` up to `end` of the segment, and its fit.

    `deficit`: the mean distance per frame to the take beyond that to the nearest frame of all takes. `margin`: the
    extra cost of the cheapest other word that leads to the same place at the same time.
    """

    word: str
    start: int
    end: int
    deficit: float
    margin: float


@dataclass(frozen=True)
class Match:
    """The best-fitting sentence, and its voice.

    `passed_over`: the mean distance of a frame outside the words to the room's noise, beyond that to the nearest frame
    of all takes: high where speech is taken for noise. `above_noise`: how much farther a frame of the words is from the
    noise than from the takes, in the mean: near 0 where words are taken for what cannot be heard.
    """

    voice: str
    words: tuple[MatchedWord, ...]
    passed_over: float
    above_noise: float


@dataclass(frozen=True, eq=False)
class _Fit:
    """The cost of one sentence over the voices that have its words: that of the best voice, less if more voices fit."""

    vote: float
    dtw: OnePassDtw
    ends: Ends
    node: int

    @cached_property
    def path(self) -> tuple[Word, ...]:
        """The best voice's words."""
        return self.dtw.trace(self.ends, self.node)


class TemplateDecoder:
    """Knows a network of sentences, and where the takes of its words are among the template frames."""

    def __init__(self, graph: WordGraph, templates: Sequence[Template]) -> None:
        """A voice need not have all words. Raises ValueError without templates of the graph's words."""
        self._templates = templates
        self._words: dict[str, set[str]] = {}
        for template in templates:
            self._words.setdefault(template.voice, set()).add(template.word)
        self.sentences = self._compiled(graph)

    def _compiled(self, graph: WordGraph) -> OnePassDtw:
        return OnePassDtw(Network(graph, self._templates, partial=True))

    def alone(self, words: tuple[str, ...]) -> OnePassDtw | None:
        """One sentence; None if nobody has its words."""
        known = any(said.issuperset(words) for said in self._words.values())
        return self._compiled(graph_of(words)) if known else None


class Hearing:
    """A segment of sound beside a decoder's sentences."""

    def __init__(self, decoder: TemplateDecoder, features: Features, rows: Features, to_noise: Costs) -> None:
        """`features` of the segment and of all template frames, `rows`; the distance of each frame of the segment to
        the room's noise."""
        self._decoder = decoder
        self._features, self._rows, self._to_noise = features, rows, to_noise
        self._fits: dict[tuple[str, ...], _Fit | None] = {}
        ends = self._forward(decoder.sentences)
        self._nearest = ends.nearest
        self._best = self._best_of(decoder.sentences, ends)

    def _forward(self, dtw: OnePassDtw) -> Ends:
        rows = self._rows if len(dtw.rows) == len(self._rows) else self._rows[dtw.rows]
        norms = norms_of(rows)
        return dtw.forward(lambda begin, end: distances(self._features[begin:end], rows, norms), self._to_noise)

    def _best_of(self, dtw: OnePassDtw, ends: Ends) -> _Fit | None:
        """The sentence that fits best in all voices, among the best ones of each voice."""
        found = _best_of_voices(dtw, ends)
        sentences = dict.fromkeys(words for _, words, _ in found)
        if len(sentences) == 1:
            return _Fit(min(found)[0], dtw, ends, min(found)[2])
        fits = [(fit.vote, words, fit) for words in sentences if (fit := self._fit(words)) is not None]
        return min(fits, key=lambda each: each[:2])[2] if fits else None

    def vote(self, words: tuple[str, ...]) -> float | None:
        """The cost of a sentence, where VOTE_COST is worth a factor of e in its odds; None if nobody has its words, or
        if the segment is too short for them."""
        fit = self._fit(words)
        return fit.vote if fit is not None else None

    @property
    def best(self) -> tuple[str, ...] | None:
        """The sentence that fits best; None if the segment is too short for any."""
        fit = self._best
        return tuple(fit.dtw.net.word[word.instance] for word in fit.path) if fit is not None else None

    @property
    def match(self) -> Match | None:
        """The best sentence, in the voice in which it fits best."""
        return self._match(self._best) if self._best is not None else None

    def _fit(self, words: tuple[str, ...]) -> _Fit | None:
        if words not in self._fits:
            dtw = self._decoder.alone(words)
            self._fits[words] = self._fitted(dtw) if dtw is not None else None
        return self._fits[words]

    def _fitted(self, dtw: OnePassDtw) -> _Fit | None:
        """The fit of the only sentence of a network."""
        ends = self._forward(dtw)
        voices = _best_of_voices(dtw, ends)
        if not voices:
            return None
        costs = np.array([cost for cost, _, _ in voices])
        vote = costs.min() - VOTE_COST * float(np.log(np.exp((costs.min() - costs) / VOTE_COST).sum()))
        return _Fit(float(vote), dtw, ends, min(voices)[2])

    def _match(self, fit: _Fit) -> Match:
        net, words, to_noise = fit.dtw.net, [], self._to_noise
        inside = np.zeros(len(to_noise), np.bool_)
        least = np.minimum(self._nearest, to_noise)
        for word in fit.path:
            excess = word.cost - float(least[word.start : word.end].sum())
            deficit = excess / (word.end - word.start)
            words.append(MatchedWord(net.word[word.instance], word.start, word.end, deficit, word.margin))
            inside[word.start : word.end] = True
        beyond = (to_noise - least)[~inside]
        passed_over = float(beyond.mean()) if len(beyond) else 0.0
        inside_noise = float(to_noise[inside].sum()) - sum(word.cost for word in fit.path)
        return Match(net.voice_of_node(fit.node), tuple(words), passed_over, inside_noise / max(int(inside.sum()), 1))


def _best_of_voices(dtw: OnePassDtw, ends: Ends) -> list[tuple[float, tuple[str, ...], int]]:
    """Least cost, words and end node of the best sentence in each voice that has one."""
    net, found = dtw.net, []
    for number in range(len(net.voices)):
        nodes = np.arange(number * net.nodes_per_voice, (number + 1) * net.nodes_per_voice)
        costs = np.where(net.is_final[nodes], ends.rest[-1, nodes], FAR)
        node = int(nodes[costs.argmin()])
        if costs.min() < FAR / 2:
            words = tuple(net.word[word.instance] for word in dtw.trace(ends, node))
            found.append((float(costs.min()), words, node))
    return found
