"""Second-pass recognition of people, where no robot's voice explains speech, by two phone nets and enrolled takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from itertools import chain, product

from hvcpd.language.addressees import FRIEND, GREETINGS, TO_ALL
from hvcpd.language.graph import Arc, WordGraph, beginning_with, ends_of
from hvcpd.language.pattern import Words
from hvcpd.language.wordings import is_call, same_meaning
from hvcpd.people import fusion
from hvcpd.people.enrolled import STRANGER, EnrolledRecogniser, Person
from hvcpd.people.fusion import DENIAL, REFUSAL, FusedHypothesis, Hypotheses
from hvcpd.people.phones import ANY_PHONE, FRAME_SAMPLES, CtcSearch, net_inputs, nets, word_loop
from hvcpd.people.speaker_adaptation import adapted_layers
from hvcpd.recognition.events import Garbled, Recognised, Source, WordSpan
from hvcpd.recognition.stages import Segment
from hvcpd.recognition.template_recogniser import RecogniserSettings
from hvcpd.synthesis.lexicon import Lexicon, common_words

MIN_PROBABILITY = RecogniserSettings.min_confidence
"""Least confidence by enrolled people's takes, as in the robots' own recogniser."""
MIN_STRANGERS_PROBABILITY = 0.75
"""Least confidence of a stranger's sentence. Of 486 sentences by three of Kokoro's voices, flite's and festival's slt,
to which nothing was fitted, in white noise at 20 dB or pink noise at 8 dB, 266 are so sure and right and 5 so sure and
wrong; with 0.7 it is 283 and 9, with 0.8 247 and 5."""
MIN_ADDRESSED = 0.7
"""Least probability that one of the sentences for this robot by name was said, where it is not sure which. 36 of
110 such sentences are so likely, and 8 of 385 for others (docs/decisions/phones.md)."""
MIN_REQUEST = 0.5
"""Least confidence of a harmless request to this robot by name, if the sentence surely is for it: of 336, 251 instead
of 235 are then reported right, and 25 instead of 17 wrong (docs/decisions/phones.md)."""
MOST_LAYERS = 2
"""People's adapted layers that are tried: each costs as much as the one for anybody."""
LAYERS_KEPT = 64
"""Layers in memory, 30 kB each: more than the people of a class."""
MOST_SURE = 0.94
"""Highest confidence of a stranger's sentence, below what coordination needs to move wheels without a confirmed
read-back: clearly spoken words that form no sentence have fitted as well as some right sentences."""

TALK_WORD_COST = 4.0
"""Of each word of other talk, nats. Of 2, 4 and 6, 4 tells sentences from all else best (docs/decisions/phones.md)."""

ANY_NAME = tuple((ANY_PHONE,) * n for n in range(2, 10))
"""The pronunciations of a name that is not known."""
DENYING = ("not", "do not", "don't", "never", "unable", "going")
"""The first words of a DENIAL ("I am not going to complete task two" was heard as an order by somebody of that name,
and "do not turn left" as one to Bot or team A), and of a REFUSAL."""
DENYING_PHONES = 6
"""Phones that may follow them, as many as "going to" has after "not"."""
COSTS = {FRIEND: 5.0, DENIAL: 5.0, REFUSAL: 1.0}
"""Of a name that is not known, and of a denial, nats by each net (docs/decisions/phones.md); and of a refusal. Of 15
refusals in voices of espeak-ng, flite and festival, with white noise at 25 dB, 15 are told as the opposite without it,
2 if it costs 5, and none if it costs 1; of 12 other sentences, by Anna, Sarah, Lynette and Nathan, one is lost."""

COURTESY = "please"
"""Said after an order, it changes nothing."""

Found = Recognised | Garbled | None
"""A sentence; garbled speech of which more is known than where it is; or nothing."""


class SecondPassRecogniser:
    """Searches segments of sound; its listeners are made when first needed, in the thread that searches."""

    def __init__(
        self,
        graph: WordGraph,
        lexicon: Lexicon,
        people: Mapping[str, Person],
        strangers: bool,
        name: str | None = None,
        is_harmless_request: Callable[[Words], bool] | None = None,
    ) -> None:
        """`people`: the enrolled ones, read again for each segment, so that newly learned words count; with
        `strangers`, all others' sentences count, too. `name`: this robot's; without one no sentence is for it.
        `is_harmless_request`: of which sentences MIN_REQUEST is enough."""
        self._graph = graph
        self._lexicon = lexicon
        self._people = people
        self._strangers = strangers
        self._name = name
        self._is_harmless_request = is_harmless_request or (lambda _: False)
        self._enrolled = lru_cache(1)(partial(EnrolledRecogniser, graph))
        self._layers = lru_cache(LAYERS_KEPT)(partial(adapted_layers, pronounce=lexicon.sounds))

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations, as long as `go_on` holds."""
        self._listener()
        if self._strangers and go_on():
            _ = self._searches
        for person in self._people.values() if self._strangers else ():
            if go_on():
                self._layers(person.sentences)

    def search(self, segment: Segment) -> Found:
        """The sentence in a segment, with its confidence. If none is sure enough, garbled speech for this robot by
        name, or None. After other speech, it must have an addressee, or be a call for a halt: that speech may be the
        name without which it means something else."""
        garbled: Garbled | None = None
        for each in segment.beginnings:
            found = self._sentence(each)
            if isinstance(found, Garbled):
                garbled = garbled or found
            elif found is not None and (each is segment or self._is_complete(found.words)):
                return found
        return garbled

    def may_go_on(self, words: Sequence[str]) -> bool:
        """Whether more words than COURTESY would make another sentence of these."""
        ends = ends_of(self._graph, self._graph.start, words)
        return any(word != COURTESY for end in ends for word, _ in self._graph.following[end])

    def _is_complete(self, words: Words) -> bool:
        """Whether a sentence is a call for a halt, or can take no addressee any more."""
        with_one = (TO_ALL, *words), (words[0], TO_ALL, *words[1:])
        ends = (ends_of(self._graph, self._graph.start, each) for each in with_one)
        return is_call(words) or not any(found & self._graph.finals for found in ends)

    def _sentence(self, segment: Segment) -> Found:
        if not self._strangers:
            return _surely(self._by_takes(segment))
        by_anybody = self.hypotheses(segment)
        hypotheses, fused = self._fused(by_anybody)
        if fused is not None and fused.probability >= MIN_STRANGERS_PROBABILITY:
            return _recognised(fused, hypotheses, segment)
        nearest = _surely(hypotheses.by_takes)
        if fused is not None and nearest is not None and fused.words == nearest.words:
            return nearest
        if self._name is None or by_anybody.probability_of(self._for_me) < MIN_ADDRESSED:
            return None
        if fused is not None and fused.probability >= MIN_REQUEST and self._is_harmless_request(fused.words):
            return _recognised(fused, hypotheses, segment)
        return Garbled(segment.start, segment.end, addressed=True)

    def compared(self, segment: Segment, words: Words | None = None) -> tuple[Recognised | None, float | None]:
        """The most likely sentence in a segment, however unlikely, and the probability of these `words`, if any are
        given, by the net for anybody."""
        by_anybody = self.hypotheses(segment)
        own = fusion.probability(fusion.confidence_features(by_anybody, words)) if words is not None else None
        hypotheses, fused = self._fused(by_anybody)
        return (_recognised(fused, hypotheses, segment) if fused is not None else None), own

    def _fused(self, hypotheses: Hypotheses) -> tuple[Hypotheses, FusedHypothesis | None]:
        """By the net for anybody, and as sure as the likeliest of the layers adapted to people, if that finds
        the same sentence; else not sure at all. Of 150 sentences by Kokoro's voices, from which no net learned, 85 are
        then right and 4 wrong with five sentences of the speaker enrolled (69 and 4 with nobody's, 78 and 3 with
        another one's)."""
        fused = fusion.fuse(hypotheses)
        through = self._through_layers(hypotheses) if fused is not None else []
        found = [(other, each) for other in through if (each := fusion.fuse(other)) is not None]
        if fused is None or not found:
            return hypotheses, fused
        surest = max(found, key=lambda each: each[1].probability)
        if not same_meaning(surest[1].words, fused.words):
            return hypotheses, replace(fused, probability=0.0)
        return max((hypotheses, fused), surest, key=lambda each: each[1].probability)

    def _through_layers(self, hypotheses: Hypotheses) -> list[Hypotheses]:
        """The hypotheses with the posteriors of people's own layers, of the MOST_LAYERS surest of their phones."""
        people = (self._layers(person.sentences) for person in self._people.values())
        found = [
            [layer.log_posteriors(each) for layer, each in zip(layers, hypotheses.activations, strict=True)]
            for layers in people
            if layers
        ]
        surest = sorted(found, key=fusion.certainty, reverse=True)[:MOST_LAYERS]
        return [replace(hypotheses, posteriors=each) for each in surest]

    def hypotheses(self, segment: Segment) -> Hypotheses:
        """The results of the nets for anybody and of the enrolled people's templates for a segment."""
        search, talk = self._searches
        inputs = net_inputs(segment)
        activations = [net.activations(inputs) for net in nets()]
        posteriors = [net.layer.log_posteriors(each) for net, each in zip(nets(), activations, strict=True)]
        return Hypotheses(posteriors, search, talk, self._by_takes(segment), activations)

    @cached_property
    def _searches(self) -> tuple[CtcSearch, CtcSearch]:
        """Of sentences, and of other talk."""
        talk = word_loop([*common_words(), *self._graph.words], self._lexicon.sounds, TALK_WORD_COST)
        return CtcSearch(_with_denials(self._graph), self._sounds, COSTS), talk

    @cached_property
    def _for_me(self) -> CtcSearch:
        """Of the sentences for this robot alone."""
        name = (self._name or "").lower()
        calls = [(name,), *((greeting, name) for greeting in GREETINGS)]
        return CtcSearch(beginning_with(self._graph, calls), self._sounds, COSTS)

    def _sounds(self, word: str) -> Sequence[Sequence[str]]:
        """A word's pronunciations. FRIEND stands for any name: the network has it only where a speaker says its own."""
        if word in (DENIAL, REFUSAL):
            denying = (ways for each in DENYING for ways in product(*map(self._lexicon.sounds, each.split())))
            return [(*chain(*said), *(ANY_PHONE,) * n) for said in denying for n in range(DENYING_PHONES + 1)]
        return ANY_NAME if word == FRIEND else self._lexicon.sounds(word)

    def _by_takes(self, segment: Segment) -> Recognised | None:
        listener = self._listener()
        return listener.recognise(segment) if listener is not None else None

    def _listener(self) -> EnrolledRecogniser | None:
        """The listener for enrolled people; None if nobody has a word of the phrasebook's."""
        words = set(self._graph.words)
        people = tuple(person for person in tuple(self._people.values()) if person.takes.keys() & words)
        return self._enrolled(people) if people else None


def _with_denials(graph: WordGraph) -> WordGraph:
    """With DENIAL wherever FRIEND may be said, at the beginning and after the first word, which may be an addressee;
    and REFUSAL after each name."""
    names = [arc for arc in graph.arcs if arc.word == FRIEND]
    denials = [Arc(arc.source, arc.target, DENIAL) for arc in names]
    firsts = {arc.target for arc in graph.arcs if arc.source == graph.start}
    denials += [Arc(node, node, DENIAL) for node in sorted({graph.start, *firsts})]
    refusals = [Arc(node, node, REFUSAL) for node in sorted({arc.target for arc in names})]
    return replace(graph, arcs=(*graph.arcs, *denials, *refusals))


def _surely(nearest: Recognised | None) -> Recognised | None:
    return nearest if nearest is not None and nearest.confidence >= MIN_PROBABILITY else None


def _recognised(fused: FusedHypothesis, hypotheses: Hypotheses, segment: Segment) -> Recognised:
    """The sentence, in the voice of an enrolled person if that fits by itself."""
    words, sure, known = fused.words, min(fused.probability, MOST_SURE), hypotheses.by_takes
    if known is not None and known.words == words and known.confidence >= MIN_PROBABILITY:
        return replace(known, confidence=max(fused.probability, known.confidence))
    begin = segment.speech_start
    spans = [
        WordSpan(word, begin + start * FRAME_SAMPLES, begin + end * FRAME_SAMPLES, fused.probability)
        for word, (start, end) in zip(words, hypotheses.spans(words), strict=True)
    ]
    return Recognised.of(spans, STRANGER, sure, Source.PEOPLE)
