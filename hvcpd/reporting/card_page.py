"""The phrase card as a page: an A4 sheet for the wall, and a second one to be cut into eight cards for the pocket."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from hvcpd.language.card import Card, Line, Topic
from hvcpd.reporting.markup import Markup, escaped, joined, tag
from hvcpd.reporting.palette import robot_slot, task_colour
from hvcpd.reporting.style import style_sheet
from hvcpd.reporting.text import listed

POCKET_CARDS = 8
"""Of 105 by 74 mm (ISO 216 A7, on its side) on one A4 sheet."""
MAX_TASKS = 14
"""Tasks that the A4 sheet has room for; of more it names so many and counts the rest."""
_POCKET_TASKS = 7

_HEADINGS = {
    Topic.ASK: "Ask",
    Topic.MOVE: "Move a robot",
    Topic.WORK: "Give work",
    Topic.ANSWER: "Answer",
    Topic.TELL: "Take part, and what robots say",
}
_ELSEWHERE = ("TASK", "NAME", "CODE WORD")
"""Words that the sheet has in another place, or that no person has to say."""
_SLOT = re.compile(r"\b[A-Z]{3,}\b")
"""A word to be filled in stands in capitals on the card."""


def card_page(card: Card, tasks: Sequence[tuple[int, str]]) -> str:
    """The page as HTML that needs nothing else; `tasks` are the team's, with their numbers."""
    head = (
        tag("meta", charset="utf-8"),
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("title", "What can be said"),
        tag("style", style_sheet("theme.css", "card.css")),
    )
    note = "Print this page on A4 without margins: the first sheet is for the wall, the second to be cut into eight."
    body = tag("body", tag("main", _wall(card, tasks), tag("p", note, class_="note"), _pockets(card, tasks)))
    return f"<!doctype html>\n{tag('html', tag('head', *head), body, lang='en')}\n"


def _wall(card: Card, tasks: Sequence[tuple[int, str]]) -> Markup:
    opening = (
        tag("p", _slots(card.opening), " …", class_="opening"),
        tag("p", "For example: ", tag("q", card.example), class_="example"),
    )
    return tag(
        "article",
        tag("header", tag("h1", "Talk to the robots"), tag("p", _who(card)), class_="head"),
        _halt(card),
        tag("p", card.courtesy, class_="polite"),
        tag(
            "div",
            _section(Topic.ASK, card.calls),
            _section(Topic.MOVE, card.calls),
            _section(Topic.WORK, card.statements, *opening),
            _section(Topic.ANSWER, card.statements),
            _tasks(tasks),
            _words(card),
            class_="columns",
        ),
        _section(Topic.TELL, card.statements),
        class_="sheet",
    )


def _who(card: Card) -> Markup:
    teams = dict(card.words).get("TEAM", ())
    return joined([_names(card), *([f" · team {listed(teams)}"] if teams else [])])


def _names(card: Card) -> Markup:
    names = dict(card.words).get("NAME", ())
    return joined((tag("b", name, class_=f"robot r{robot_slot(k)}") for k, name in enumerate(names)), ", ")


def _halt(card: Card) -> Markup:
    names = dict(card.words).get("NAME", ())[:1]
    calls = listed(f"“{name} stop”" for name in (*names, "all"))
    return tag(
        "section",
        tag("b", "“Stop”"),
        tag("p", f"or {calls}: anybody, at any time, without a greeting. Who hears it halts and stays halted."),
        tag("b"),
        tag("p", "“Resume”: halted robots may take on tasks again. No old motion starts by it."),
        class_="halt",
        aria_label="Stop",
    )


def _section(topic: Topic, lines: Iterable[Line], *before: Markup) -> Markup | None:
    mine = [line for line in lines if line.topic is topic]
    if not mine:
        return None
    rows = [tag("div", tag("dt", _slots(line.say)), " ", tag("dd", line.meaning)) for line in mine]
    return tag("section", tag("h2", _HEADINGS[topic]), *before, tag("dl", *rows), class_=topic.name.lower())


def _tasks(tasks: Sequence[tuple[int, str]]) -> Markup | None:
    if not tasks:
        return None
    rows = [tag("li", tag("b", str(number)), _dot(name), name) for number, name in tasks[:MAX_TASKS]]
    if len(tasks) > MAX_TASKS:
        rows.append(tag("li", f"and {len(tasks) - MAX_TASKS} more: hvcpctl phrases"))
    title = joined(
        ["The tasks (", tag("span", "TASK", class_="slot"), ", by ", tag("span", "NUMBER", class_="slot"), ")"]
    )
    return tag("section", tag("h2", title), tag("ul", *rows, class_="tasks"))


def _dot(name: str) -> Markup:
    circle = tag("circle", cx=5, cy=5, r=4.4, fill=task_colour(name), stroke="#0005")
    return tag("svg", circle, class_="dot", viewBox="0 0 10 10", width=11, height=11, aria_hidden="true")


def _words(card: Card) -> Markup:
    shown = {slot: ", ".join(entries) for slot, entries in card.words if slot not in _ELSEWHERE}
    names = dict(card.words).get("NAME", ())
    others = [entry for entry in dict(card.words).get("WHO", ()) if entry not in names]
    shown["WHO"] = ", ".join([*others, *(["or a robot's name"] if names else [])])
    rows = [tag("div", tag("dt", _slots(slot)), " ", tag("dd", words)) for slot, words in shown.items()]
    return tag("section", tag("h2", "Words to fill in"), tag("dl", *rows))


def _pockets(card: Card, tasks: Sequence[tuple[int, str]]) -> Markup:
    first = _pocket(card, tasks)
    copies = [tag("div", first, class_="pocket")]
    copies += [tag("div", first, class_="pocket", aria_hidden="true")] * (POCKET_CARDS - 1)
    return tag("article", *copies, class_="sheet pockets", aria_label="For the pocket")


def _pocket(card: Card, tasks: Sequence[tuple[int, str]]) -> Markup:
    asked = " · ".join(line.say.replace("[WHO,] ", "").replace("WHO, ", "all, ") for line in _of(card, Topic.ASK))
    moved = " · ".join(line.say.replace("[WHO,] ", "") for line in _of(card, Topic.MOVE))
    work = ", ".join(f"{number} {name}" for number, name in tasks[:_POCKET_TASKS])
    more = " …" if len(tasks) > _POCKET_TASKS else ""
    rows = [("Ask: ", asked), ("Move: ", f"NAME, … {moved}"), ("Give work: ", f"{card.opening}, TASK")]
    rows.append(("Answer: ", "… confirmed · negative · say again · say again slowly"))
    halt = tag("div", tag("b", "“Stop”"), tag("p", "anybody, at any time; then “resume”"), class_="halt")
    return joined(
        [
            tag("h2", _names(card)),
            halt,
            tag("ul", *(tag("li", tag("b", title), _slots(text)) for title, text in rows if text)),
            tag("p", f"Tasks: {work}{more}", class_="small") if work else Markup(),
            tag("p", "For example: ", card.example, class_="small"),
        ]
    )


def _of(card: Card, topic: Topic) -> list[Line]:
    return [line for line in card.calls if line.topic is topic]


def _slots(text: str) -> Markup:
    """The text with the words to be filled in marked."""
    parts: list[str] = []
    end = 0
    for found in _SLOT.finditer(text):
        parts += [escaped(text[end : found.start()]), tag("i", found[0])]
        end = found.end()
    return joined([*parts, text[end:]])
