"""The card on the wall: everything that people can say, made from the forms and the vocabulary."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

from hvcpd.language import messages as m
from hvcpd.language.clashes import NUMBER_SLOTS
from hvcpd.language.forms import (
    AND_ALSO,
    AND_THEN,
    CALL,
    CALL_TO,
    FORMS,
    OPENING,
    PASSED_ON,
    PLEASE,
    TWO_TASKS,
    Form,
    Kind,
)
from hvcpd.language.marks import CIPHER_CALL, SEAL_WORDS, mark_words
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.spelling import BITS, CODE_WORDS, WORD_OF

_PLACEHOLDERS = {"addressee": "WHO", "speaker": "NAME", "metres": "DISTANCE"} | dict.fromkeys(NUMBER_SLOTS, "NUMBER")
"""Of slots that have another word on the card than their own in capitals."""


class Topic(Enum):
    """The purpose of a line."""

    STOP = "stop"
    ASK = "ask"
    MOVE = "move"
    WORK = "give work"
    ANSWER = "answer"
    TELL = "tell"


_TOPICS: dict[type[m.Statement], Topic] = {
    m.Stop: Topic.STOP,
    m.Resume: Topic.STOP,
    **dict.fromkeys((m.WhatDoing, m.WhoHere, m.Hail, m.WhatLeft, m.ReportWanted), Topic.ASK),
    **dict.fromkeys((m.ComeBack, m.MoveBy, m.TurnBy), Topic.MOVE),
    m.Order: Topic.WORK,
    **dict.fromkeys((m.Confirmed, m.Negative, m.SayAgain, m.NotUnderstood), Topic.ANSWER),
}
"""Every other statement is about its speaker."""

ROBOTS_ALONE = frozenset((m.SealedMessage, m.HowFarAway, m.Measuring, m.Measured, m.CannotMeasure))
"""Statements that are of no use to people: nobody knows the samples of a person's sentence."""


@dataclass(frozen=True)
class Line:
    """One sentence pattern, with words to be filled in written in capitals, its meaning, and its purpose."""

    say: str
    meaning: str
    topic: Topic


COURTESY = (
    "“Hello” is “Hi”, and “please” may go before what you ask for; [brackets], and “Hi” and your name "
    "before an order or answer, may be left out; pause at the commas."
)


@dataclass(frozen=True)
class Card:
    """The whole card: calls for anybody, the opening of every sentence, its continuations, and the words to fill in."""

    calls: tuple[Line, ...]
    opening: str
    statements: tuple[Line, ...]
    words: tuple[tuple[str, tuple[str, ...]], ...]
    example: str
    courtesy: str


def make_card(phrasebook: Phrasebook) -> Card:
    """The card of a team's phrasebook."""
    vocabulary = phrasebook.vocabulary
    calls, statements = [], []
    forms = [form for form in FORMS if not (form.casual and _topic(form) in (Topic.WORK, Topic.ANSWER))]  # see COURTESY
    called = {(_plain(f).removeprefix(CALL).removeprefix(CALL_TO).strip(), f.meaning) for f in forms if _is_call(f)}
    for form in forms:
        pattern, topic = _plain(form), _topic(form)
        if form.kind not in vocabulary.kinds or form.relayed or form.will:
            continue
        if any(second in pattern for second in ("<confirmed>", "<away>", *TWO_TASKS)):  # two sentences in one turn
            continue
        if any(f"<{slot}>" in pattern and not phrasebook.slots[slot] for slot in ("remark", "reason", "place", "task")):
            continue
        if form.statement in ROBOTS_ALONE:
            continue
        if form.spelled:
            spelled = _written(pattern.split(", ", 1)[1])
            statements.append(Line(f"instead of the name: {spelled}", form.meaning, Topic.TELL))
        elif pattern.startswith(OPENING):
            rest = pattern[len(OPENING) :].lstrip(", ")
            if rest and (rest, form.meaning) not in called:
                statements.append(Line(_written(rest), form.meaning, topic))
        else:
            calls.append(Line(_call(pattern), form.meaning, topic))
    statements += _proofs(phrasebook)
    addressees = [str(to) for to in phrasebook.slots["addressee"] if to != m.ToRobot(m.FRIEND)]
    words: list[tuple[str, tuple[str, ...]]] = [
        ("WHO", tuple(addressees)),
        ("NAME", vocabulary.names),
        ("TEAM", vocabulary.teams),
        ("NUMBER", tuple(" ".join(spoken) for spoken in phrasebook.slots["number"].values())),
        ("TASK", vocabulary.tasks),
        ("DISTANCE", tuple(" ".join(spoken) for spoken in phrasebook.slots["metres"].values())),
        ("PLACE", tuple(" ".join(spoken) for spoken in phrasebook.slots["place"].values())),
        ("REMARK", vocabulary.remarks),
        ("REASON", vocabulary.failures),
        ("LETTERS", tuple(word for letter, word in WORD_OF.items() if letter.isalpha())),
        ("CODE WORD", CODE_WORDS if Kind.SEALED in vocabulary.kinds else ()),
    ]
    opening = _written(OPENING)
    return Card(
        tuple(calls),
        opening[:1].upper() + opening[1:],
        tuple(statements),
        tuple((slot, entries) for slot, entries in words if entries),
        _example(phrasebook),
        COURTESY,
    )


def _proofs(phrasebook: Phrasebook) -> list[Line]:
    """The marks of a team with a key, after its sentences or in their place; the code words are an example."""
    kinds, lines = phrasebook.vocabulary.kinds, []
    if Kind.SEALED in kinds:
        seal, code = m.Seal(_EXAMPLE % (1 << BITS * SEAL_WORDS)), m.Code("123456")
        lines.append(Line(f"…, {' '.join(mark_words(seal))}", "A robot's seal: it said that, and now.", Topic.TELL))
        lines.append(Line(f"…, {' '.join(mark_words(code))}", "A person's one-time code.", Topic.WORK))
    if Kind.ENCRYPTED in kinds:
        cipher = m.Cipher(_EXAMPLE, phrasebook.cipher_words)
        said = f"{' '.join(CIPHER_CALL)}, {' '.join(mark_words(cipher))}"
        lines.append(Line(said, "Something for robots with the key.", Topic.TELL))
    return lines


_EXAMPLE = 0xC0FFEE15BAD
"""No robot's seal: any number shows what one sounds like."""


def _topic(form: Form) -> Topic:
    return _TOPICS.get(form.statement, Topic.TELL) if form.statement is not None else Topic.TELL


def _plain(form: Form) -> str:
    """The pattern without words that only robots say, and without politeness: the card says once where "please" may
    stand."""
    pattern = form.pattern
    for words in (PASSED_ON, PLEASE, AND_ALSO, AND_THEN):
        pattern = pattern.replace(words, "")
    return " ".join(pattern.split())


def _example(phrasebook: Phrasebook) -> str:
    words = phrasebook.vocabulary
    if len(words.names) < 2 or not words.tasks:
        return "Hi all, I am " + (words.names[0] if words.names else "…")
    last = words.tasks[len(words.numbers) - 1]  # of the team's own; after them come others that it may hear of
    return f"Hi {words.names[0]}, I am {words.names[1]}, {last}"


def _call(pattern: str) -> str:
    """A call as on the card: "[WHO,] come back"."""
    return _written(pattern.replace(CALL, "[<addressee>,]").replace(CALL_TO, "<addressee>,"))


def _is_call(form: Form) -> bool:
    return form.pattern.startswith((CALL, CALL_TO))


def _written(pattern: str) -> str:
    pattern = re.sub("<([a-z]+)>", lambda slot: _PLACEHOLDERS.get(slot[1], slot[1].upper()), pattern)
    pattern = pattern.replace(" [, ", "[, ").replace(" i ", " I ").replace("(hi|hello)", "hi")
    return "I " + pattern[2:] if pattern.startswith("i ") else pattern


def as_text(card: Card) -> str:
    """For the terminal, within 80 columns where the words allow it."""
    width = max(len(line.say) for line in (*card.calls, *card.statements)) + 2
    lines = ["What can be said", "", "Anybody, at any time:"]
    lines += [f"  {line.say:<{width}}{line.meaning}" for line in card.calls]
    lines += ["", f"Everything else opens with:  {card.opening}", "and goes on with nothing, or one of:"]
    lines += [f"  {line.say:<{width}}{line.meaning}" for line in card.statements]
    lines += ["", "Words to fill in:"]
    lines += [f"  {slot:<10}{', '.join(entries)}" for slot, entries in card.words]
    lines += ["", card.courtesy, f"For example:  {card.example}", ""]
    return "\n".join(lines)


def as_markdown(card: Card) -> str:
    """For a page in a wiki or a repository."""

    def table(lines: tuple[Line, ...]) -> list[str]:
        rows = [f"| {_md(line.say)} | {_md(line.meaning)} |" for line in lines]
        return ["| say | it means |", "|---|---|", *rows, ""]

    out = ["# What can be said", "", "## Anybody, at any time", "", *table(card.calls)]
    out += ["## Everything else", "", f"opens with **{_md(card.opening)}** and goes on with nothing, or one of:", ""]
    out += table(card.statements)
    out += ["## Words to fill in", ""]
    out += [f"- **{slot}**: {', '.join(_md(e) for e in entries)}" for slot, entries in card.words]
    out += ["", card.courtesy, "", f"For example: *{_md(card.example)}*", ""]
    return "\n".join(out)


def _md(text: str) -> str:
    return text.replace("|", "\\|").replace("[", "\\[").replace("]", "\\]")
