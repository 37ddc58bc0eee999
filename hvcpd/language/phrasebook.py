"""The phrasebook of one team: the forms, filled with its names, teams and tasks."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, groupby
from typing import Protocol, TypeVar

from hvcpd.errors import PhraseError
from hvcpd.language import messages as m
from hvcpd.language.automaton import build_graph
from hvcpd.language.binding import CompiledForm, bindings_of, build
from hvcpd.language.clashes import COMPILED, NUMBER_SLOTS, refuse_clashes, refuse_reserved
from hvcpd.language.codebook import Codebook
from hvcpd.language.explaining import why_not
from hvcpd.language.forms import CHANGES, OPEN_KINDS, Form, Kind
from hvcpd.language.graph import WordGraph, with_phrases
from hvcpd.language.marks import CIPHER_TAG_BYTES, hidden, mark_words, markable, split_mark, with_marks
from hvcpd.language.pattern import COMMA, LETTERS_SLOT, Bindings, Node, SlotValues, Words, as_rendered, match, render
from hvcpd.language.spelling import WORD_OF, letter_words, words_for
from hvcpd.language.variants import as_spoken, by_word, refuse_senseless
from hvcpd.language.words import digit_words, number_words, spoken_phrases, spoken_words, strict_words

_T = TypeVar("_T")

HIGHEST_NUMBER_ALWAYS_KNOWN = 10
"""Task numbers up to here can be spoken of even when no such task exists, so that an order for one is refused aloud."""

DISTANCES_M = {0.5: "half a metre", 1.0: "one metre", 2.0: "two metres", 3.0: "three metres", 5.0: "five metres"}
"""Distances that a robot can be ordered to move in one go: far enough for a room, and few words to be confused."""

CLAIM_DISTANCES_M = {n: f"{n} {'metre' if n == 1 else 'metres'}" for n in range(1, HIGHEST_NUMBER_ALWAYS_KNOWN + 1)}
"""Ways to a task, as stated with a claim: they share their words with task numbers."""

VOLTS_STEP = 0.5
VOLTS = {n + half: f"{n}{' and a half' if half else ''}" for n in range(9, 13) for half in (0.0, VOLTS_STEP)}
"""Of a battery, in V: a TurtleBot3's has 12.6 V when full and is cut off at 11.0 V (ROBOTIS e-Manual); half a volt
tells whether it lasts another shift."""

_KEEP_CASE = {"i": "I"}


class Chooser(Protocol):
    """The interface of a random generator for `sample`; `random.Random` has it."""

    def choice(self, seq: Sequence[_T], /) -> _T: ...


@dataclass(frozen=True)
class Vocabulary:
    """The words that differ from team to team. Task names and remarks are written; names keep their capitals."""

    names: tuple[str, ...] = ()
    teams: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()
    numbers: tuple[int, ...] = ()
    remarks: tuple[str, ...] = ()
    failures: tuple[str, ...] = ()
    places: tuple[str, ...] = ()
    alternatives: tuple[tuple[str, str], ...] = ()
    """Words, and phrases that count as them when they are heard: ("indigo", "in the go")."""
    kinds: frozenset[Kind] = OPEN_KINDS
    """Kinds of forms that this team uses; each makes every listener's network larger."""


WORDS = ("remarks", "failures", "places")
"""Parts of a vocabulary that come from what the tasks do, and not from their names."""


class Phrasebook:
    """Everything that can be said with a vocabulary: `parse(render(u)) == u` for every utterance of its forms.

    Raises PhraseError when two entries of the vocabulary would be spoken the same way, when an entry reads as
    another sentence of the forms, or when an alternative is of no word of the phrasebook or can be said in its place.
    """

    def __init__(self, vocabulary: Vocabulary) -> None:
        self.vocabulary = vocabulary
        self._named_slots = _slot_values(vocabulary)
        self.slots = _with_friend(self._named_slots)
        self._forms = tuple(compiled for compiled in COMPILED if compiled.form.kind in vocabulary.kinds)
        refuse_reserved(vocabulary.names)
        refuse_clashes(list(self._usable_forms()), self.slots, self.render, self._readings)
        if vocabulary.alternatives:
            refuse_senseless(self.graph, self.alternatives)

    def phrases(self, utterance: m.Utterance) -> tuple[Words, ...]:
        """The spoken words of an utterance, one tuple for each part between commas.

        Raises PhraseError when no form makes it, or when it has a name or a task that is not in the vocabulary.
        """
        return _parts(self._tokens(utterance, {**self.slots, **self._paused_slots}))

    def render(self, utterance: m.Utterance) -> Words:
        """The spoken words of an utterance, without pauses. Raises as `phrases` does."""
        return tuple(token for token in self._tokens(utterance, self.slots) if token != COMMA)

    def write(self, utterance: m.Utterance) -> str:
        """The utterance as a person writes it: "Hi Rob, I am Bot, water the yellow rose". Raises as `phrases`."""
        parts = _parts(self._tokens(utterance, self._written_slots))
        text = ", ".join(" ".join(_cased(word, _KEEP_CASE) for word in part) for part in parts)
        return text[:1].upper() + text[1:]

    def parse(self, words: Sequence[str]) -> m.Utterance:
        """The meaning of spoken words. Raises PhraseError naming the first word that no form has there."""
        given = tuple(words)
        meaning = self._meaning(given)
        if meaning is None:
            raise PhraseError(why_not([(given, self.graph)], self.vocabulary.names))
        return meaning

    def parse_text(self, text: str) -> m.Utterance:
        """The meaning of a written sentence; capitals and punctuation do not matter. Raises PhraseError.

        Ordinary variants of its words are understood: contractions, American spellings, decimals.
        """
        words = strict_words(text)
        if (meaning := self._meaning(words)) is not None:
            return meaning
        readings = [(as_spoken(graph, words), graph) for graph in (self.graph, self.people_graph)]
        for read, _ in readings:
            if (meaning := self._meaning(read)) is not None:
                return meaning
        raise PhraseError(why_not(readings, self.vocabulary.names))

    def _meaning(self, words: Words) -> m.Utterance | None:
        """The meaning of a sentence, with or without a seal; None if it is none."""
        first = next(self._readings(words), None)
        if first is None and Kind.SEALED in self.vocabulary.kinds:
            sentence, mark = split_mark(words)
            first = next(self._readings(sentence), None) if mark is not None else None
            first = first and replace(first, mark=mark)
        return first

    @cached_property
    def graph(self) -> WordGraph:
        """The network of all sentences but spelled names, for the recogniser."""
        return build_graph([compiled.node for compiled in self._ordinary_forms()], self._robots_slots)

    @cached_property
    def marked_graph(self) -> WordGraph:
        """The graph of a team with a key: with a seal or a code after the sentences that have them."""
        if Kind.SEALED not in self.vocabulary.kinds:
            return self.graph
        return self._marked([(c.form, c.node) for c in self._ordinary_forms()])

    @cached_property
    def robots_graph(self) -> WordGraph:
        """The part of `marked_graph` that robots say: of words that mean the same, they say the first."""
        return self._marked([(c.form, as_rendered(c.node)) for c in self._ordinary_forms()])

    def _marked(self, patterns: Sequence[tuple[Form, Node]]) -> WordGraph:
        if Kind.SEALED not in self.vocabulary.kinds:
            return build_graph([node for _, node in patterns], self._robots_slots)
        encrypts = Kind.ENCRYPTED in self.vocabulary.kinds
        graph = build_graph([markable(form, node, encrypts) for form, node in patterns], self._robots_slots)
        return with_marks(graph, self.cipher_words if encrypts else 0)

    @cached_property
    def codebook(self) -> Codebook:
        """The numbers of all statements, for encryption."""
        return Codebook(self._ordinary_forms(), self.slots)

    @property
    def cipher_words(self) -> int:
        """Number of code words of an encrypted statement; all have the same."""
        return words_for(8 * (self.codebook.n_bytes + CIPHER_TAG_BYTES))

    @cached_property
    def people_graph(self) -> WordGraph:
        """The network `graph`, plus sentences of people who do not know the phrasebook; FRIEND stands for the name of a
        speaker that is not known."""
        slots = {**self._named_slots, **self._paused_slots, "speaker": self.slots["speaker"]}
        return build_graph([c.node for c in self._usable_forms() if not c.form.spelled], slots)

    @cached_property
    def spelling_graph(self) -> WordGraph:
        """The network of spelled names; it holds no name, so it is the same for all robots with the same teams."""
        addressees = {to: words for to, words in self.slots["addressee"].items() if not isinstance(to, m.ToRobot)}
        forms = [c.node for c in COMPILED if c.form.spelled]
        return build_graph(forms, {**self.slots, "addressee": addressees})

    @cached_property
    def alternatives(self) -> dict[str, tuple[Words, ...]]:
        """For each word that has some, the phrases that count as it when they are heard."""
        return by_word(self.vocabulary.alternatives)

    @cached_property
    def heard_graph(self) -> WordGraph:
        """The network with its alternatives, as it sounds. The recognised sentence is one of `graph`."""
        return with_phrases(self.graph, ((word, p) for word, phrases in self.alternatives.items() for p in phrases))

    def sample(self, chooser: Chooser) -> m.Utterance:
        """A random utterance of the network `graph`, without FRIEND: a form is drawn, then each of its parts."""
        compiled = chooser.choice(self._ordinary_forms())
        bindings: Bindings = {}
        for slot in sorted(compiled.slots):
            if slot == "third" and "second" not in bindings:
                continue
            if slot in compiled.needed or chooser.choice((True, False)):
                bindings[slot] = chooser.choice(list(self._named_slots[slot]))
        return build(compiled.form, bindings)

    @property
    def _robots_slots(self) -> SlotValues:
        """Robots speak to a person whose name is not known, and of one; none says that it is one."""
        return {**self.slots, **self._paused_slots, "speaker": self._named_slots["speaker"]}

    @cached_property
    def _paused_slots(self) -> SlotValues:
        """The remarks with the commas at which a robot pauses."""
        return {"remark": {text: _paused(text) for text in self.vocabulary.remarks}}

    def _ordinary_forms(self) -> list[CompiledForm]:
        return [c for c in self._usable_forms() if not c.form.spelled and not c.form.casual]

    def _usable_forms(self) -> Iterator[CompiledForm]:
        for compiled in self._forms:
            if all(self._named_slots[slot] for slot in compiled.needed - {LETTERS_SLOT}):
                yield compiled

    @cached_property
    def _written_slots(self) -> SlotValues:
        """`slots` with names as they are written, and with the capitals that remarks give them: the same word
        elsewhere, as in "the rose" beside Rose, is no name."""
        names = {name.lower(): name for name in map(str, self.slots["speaker"])}
        written: dict[object, Words] = {name: (name,) for name in names.values()}
        robots: dict[object, Words] = {m.ToRobot(name): (name,) for name in names.values()}
        remarks: dict[object, Words] = {}
        for text, words in self.slots["remark"].items():
            capitals = {name.lower(): name for name in re.findall(r"\w+", str(text)) if name in written}
            remarks[text] = tuple(_cased(word, capitals) for word in words)
        return {
            **self.slots,
            "speaker": written,
            "other": written,
            "addressee": {**self.slots["addressee"], **robots},
            "remark": remarks,
        }

    def can_say(self, utterance: m.Utterance) -> bool:
        """Whether there are words for all that it names."""
        try:
            self._tokens(utterance, self.slots)
        except PhraseError:
            return False
        return True

    def _tokens(self, utterance: m.Utterance, slots: SlotValues) -> list[str]:
        audible = hidden(utterance)
        for compiled in self._forms:
            bindings = bindings_of(compiled, audible)
            if bindings is None:
                continue
            spoken = {slot: _words_of(slots, slot, value) for slot, value in bindings.items()}
            known = {slot: words for slot, words in spoken.items() if words is not None}
            tokens = render(compiled.node, known) if len(known) == len(spoken) else None
            if tokens is not None:
                return tokens if utterance.mark is None else [*tokens, COMMA, *mark_words(utterance.mark)]
        raise PhraseError(f"the phrasebook has no words for {utterance}")

    def _readings(self, words: Words) -> Iterator[m.Utterance]:
        spoken = frozenset(words)
        for compiled, possible in self._forms_with_words:
            if not compiled.words <= spoken or not (possible is None or spoken <= possible):
                continue  # this is the usual case, and matching a pattern is slow
            for end, bindings in match(compiled.node, words, 0, self.slots):
                if end == len(words):
                    yield self._as_known(build(compiled.form, bindings))

    @cached_property
    def _forms_with_words(self) -> tuple[tuple[CompiledForm, frozenset[str] | None], ...]:
        """Each form with all words that its sentences may have; None where those are any letters."""
        said = {slot: frozenset(chain.from_iterable(values.values())) for slot, values in self.slots.items()}
        return tuple(
            (c, None if LETTERS_SLOT in c.slots else c.all_words.union(*(said[slot] for slot in c.slots)))
            for c in self._forms
        )

    def _as_known(self, utterance: m.Utterance) -> m.Utterance:
        """A spelled name, in the known writing if it is known; who orders or answers without a name is a friend."""
        if utterance.speaker is None and isinstance(utterance.statement, m.Order | m.Confirmed | m.Negative):
            return replace(utterance, speaker=m.FRIEND)
        if isinstance(utterance.statement, m.Spelled) and (known := self.known_name(utterance.statement.letters)):
            return replace(utterance, speaker=known)
        return utterance

    def known_name(self, name: str) -> str | None:
        """The name as the vocabulary writes it, whatever its case; None if it is not known."""
        return next((known for known in self.vocabulary.names if known.lower() == name.lower()), None)


def _cased(word: str, cases: Mapping[str, str]) -> str:
    """The word with its capitals, if it has some: "I", "I'm", "Rob's"."""
    name, apostrophe, ending = word.partition("'")
    return cases.get(name, name) + apostrophe + ending


def _with_friend(slots: SlotValues) -> SlotValues:
    return {
        **slots,
        "addressee": {**slots["addressee"], m.ToRobot(m.FRIEND): (m.FRIEND,)},
        **{slot: {**slots[slot], m.FRIEND: (m.FRIEND,)} for slot in ("speaker", "other")},
    }


def _parts(tokens: Sequence[str]) -> tuple[Words, ...]:
    """The words between the pauses."""
    return tuple(tuple(part) for is_pause, part in groupby(tokens, COMMA.__eq__) if not is_pause)


def _paused(text: str) -> Words:
    return tuple(chain.from_iterable((COMMA, *phrase) for phrase in spoken_phrases(text)))[1:]


def _words_of(slots: SlotValues, slot: str, value: object) -> Words | None:
    if slot != LETTERS_SLOT:
        return slots[slot].get(value)
    letters = str(value)
    return letter_words(letters) if set(letters) <= WORD_OF.keys() else None


def _slot_values(vocabulary: Vocabulary) -> SlotValues:
    numbers = sorted({*range(1, HIGHEST_NUMBER_ALWAYS_KNOWN + 1), *vocabulary.numbers})
    refs: dict[object, Words] = {m.TaskByNumber(n): number_words(n) for n in numbers}
    addressees: dict[object, Words] = {m.ToAll(): ("all",)}
    addressees |= {m.ToTeam(team): ("team", *spoken_words(team)) for team in vocabulary.teams}
    addressees |= {m.ToRobot(name): (name.lower(),) for name in vocabulary.names}
    return {
        "addressee": addressees,
        "speaker": {name: (name.lower(),) for name in vocabulary.names},
        "team": {team: spoken_words(team) for team in vocabulary.teams},
        **dict.fromkeys(NUMBER_SLOTS, refs),
        "other": {name: (name.lower(),) for name in vocabulary.names},
        "metres": {distance_m: spoken_words(text) for distance_m, text in DISTANCES_M.items()},
        "away": {distance_m: spoken_words(text) for distance_m, text in CLAIM_DISTANCES_M.items()},
        "volts": {volts: spoken_words(text) for volts, text in VOLTS.items()},
        "count": {n: number_words(n) for n in range(1, CHANGES + 1)},
        **{half: {n: digit_words(n) for n in range(100)} for half in ("hundreds", "rest")},
        "place": {name: ("the", *spoken_words(name)) for name in vocabulary.places},
        "task": {m.TaskByName(name): spoken_words(name) for name in vocabulary.tasks},
        "remark": {text: spoken_words(text) for text in vocabulary.remarks},
        "reason": {text: spoken_words(text) for text in vocabulary.failures},
    }
