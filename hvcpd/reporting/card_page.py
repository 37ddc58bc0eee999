"""The phrase card as a page: an A4 sheet for the wall, and sheets to be cut into eight cards for the pocket."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

from markupsafe import Markup

from hvcpd.config.tasks import TaskDefinition
from hvcpd.language.card import Card, Line, Topic
from hvcpd.reporting.icons import badge
from hvcpd.reporting.markup import document, escaped, joined, tag
from hvcpd.reporting.palette import robot_slot, style_sheet
from hvcpd.reporting.text import listed

POCKET_CARDS = 8
"""Of 105 by 74 mm (ISO 216 A7, on its side) on one A4 sheet."""
_WALL_LINE, _WALL_LINES = 42, 6
"""Letters of a line on the sheet for the wall (90 mm at 8.8 points), and lines that it has for tasks; more have a sheet
of their own."""
_MANY_LETTERS = 80
"""Letters of the names and the example beyond which the sheet for the wall has smaller print."""
_MAX_WORDS = 26
"""Words to fill in that the sheet has room for: as many as there are letters to spell with."""
_POCKET_LINE = 56
"""Letters of a line on a card for the pocket: 93 mm at 8.1 points, and room for wide ones."""
_FIRST_LINES, _NEXT_LINES = 4, 14
"""Lines for tasks on the first card for the pocket, below all else, and on one that has nothing but tasks."""

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


def card_page(card: Card, tasks: Sequence[TaskDefinition]) -> str:
    """The page as HTML that needs nothing else; `tasks` are the team's."""
    more = _more_tasks(tasks)
    wall = "the first sheet is for the wall" if more is None else "the first two sheets are for the wall"
    note = f"Print this page on A4 without margins: {wall}; cut the rest into eight."
    main = tag("main", _wall(card, tasks), more, tag("p", note, class_="note"), *_pockets(card, tasks))
    return document("What can be said", style_sheet("theme.css", "card.css"), main)


def _wall(card: Card, tasks: Sequence[TaskDefinition]) -> Markup:
    opening = (
        tag("p", _slots(card.opening), " …", class_="opening"),
        tag("p", "For example: ", tag("q", card.example), class_="example"),
    )
    letters = sum(map(len, (*dict(card.words).get("NAME", ()), card.example)))
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
        class_="sheet tight" if letters > _MANY_LETTERS else "sheet",
    )


def _who(card: Card) -> Markup:
    teams = dict(card.words).get("TEAM", ())
    return joined([_names(card), *([f" · team{'s' * (len(teams) > 1)} {listed(teams)}"] if teams else [])])


def _names(card: Card) -> Markup:
    names = dict(card.words).get("NAME", ())
    return joined((tag("b", name, class_=f"robot r{robot_slot(k)}") for k, name in enumerate(names)), ", ")


def _halt(card: Card) -> Markup:
    names = dict(card.words).get("NAME", ())[:1]
    calls = listed(f"“{name} stop”" for name in (*names, "all"))
    return tag(
        "section",
        tag("b", "“Stop”"),
        tag("p", f"or {calls}: anybody, at any time, without a greeting. Robots that hear it stay halted."),
        tag("b"),
        tag("p", "“Resume”: halted robots may take on tasks again. This starts no old motion."),
        class_="halt",
        aria_label="Stop",
    )


def _section(topic: Topic, lines: Iterable[Line], *before: Markup) -> Markup | None:
    mine = [line for line in lines if line.topic is topic]
    if not mine:
        return None
    rows = [tag("div", tag("dt", _slots(line.say)), " ", tag("dd", line.meaning)) for line in mine]
    return tag("section", tag("h2", _HEADINGS[topic]), *before, tag("dl", *rows), class_=topic.name.lower())


def _tasks(tasks: Sequence[TaskDefinition]) -> Markup | None:
    if not tasks:
        return None
    there = tag("p", f"{len(tasks)} tasks, on the next sheet.", class_="example")
    return tag("section", _tasks_heading(), _task_list(tasks) if _fit_on_wall_card(tasks) else there)


def _fit_on_wall_card(tasks: Sequence[TaskDefinition]) -> bool:
    return sum(math.ceil(len(_numbered(task)) / _WALL_LINE) for task in tasks) <= _WALL_LINES


def _tasks_heading() -> Markup:
    by_name, by_number = (tag("span", slot, class_="slot") for slot in ("TASK", "NUMBER"))
    return tag("h2", "The tasks (", by_name, ", by ", by_number, ")")


def _task_list(tasks: Sequence[TaskDefinition]) -> Markup:
    rows = (
        tag("li", tag("b", str(task.number)), badge(task.icon, task.name), tag("span", task.name)) for task in tasks
    )
    return tag("ul", *rows, class_="tasks")


def _more_tasks(tasks: Sequence[TaskDefinition]) -> Markup | None:
    """A separate sheet, for tasks that do not fit on the one for the wall."""
    if _fit_on_wall_card(tasks):
        return None
    return tag("article", _tasks_heading(), _task_list(tasks), class_="sheet all-tasks")


def _words(card: Card) -> Markup:
    shown = {slot: _enumerated(entries) for slot, entries in card.words if slot not in _ELSEWHERE}
    names = dict(card.words).get("NAME", ())
    others = [entry for entry in dict(card.words).get("WHO", ()) if entry not in names]
    shown["WHO"] = ", ".join([*others, *(["or a robot's name"] if names else [])])
    rows = [tag("div", tag("dt", _slots(slot)), " ", tag("dd", words)) for slot, words in shown.items()]
    return tag("section", tag("h2", "Words to fill in"), tag("dl", *rows))


def _enumerated(words: Sequence[str]) -> str:
    """The words; if they need several lines, only the first and the last."""
    return ", ".join(words if len(words) <= _MAX_WORDS else (*words[:3], "…", words[-1]))


def _pockets(card: Card, tasks: Sequence[TaskDefinition]) -> list[Markup]:
    """Sheets of eight: as many whole sets of a person's cards as fit on one, or one set over several sheets."""
    packs = _packed(tasks)
    cards = [_first_pocket(card, packs[0], len(packs))]
    cards += [_next_pocket(pack, number, _in_two_columns(tasks)) for number, pack in enumerate(packs[1:], 2)]
    copies = [
        tag("div", each, class_="pocket", aria_hidden=None if k == 0 else "true")
        for k in range(max(POCKET_CARDS // len(cards), 1))
        for each in cards
    ]
    return [
        tag("article", *copies[k : k + POCKET_CARDS], class_="sheet pockets", aria_label="For the pocket")
        for k in range(0, len(copies), POCKET_CARDS)
    ]


def _packed(tasks: Sequence[TaskDefinition]) -> list[list[TaskDefinition]]:
    """The tasks card by card: all on the first if there is room, else as many on each further one as fit there."""
    if len(", ".join(map(_numbered, tasks))) <= _FIRST_LINES * _POCKET_LINE:
        return [list(tasks)]
    packs: list[list[TaskDefinition]] = [[], []]
    room, narrow = 0.0, _in_two_columns(tasks)
    for task in tasks:
        needs = 0.5 if narrow else math.ceil(len(_numbered(task)) / _POCKET_LINE)
        if room + needs > _NEXT_LINES:
            packs.append([])
            room = 0.0
        packs[-1].append(task)
        room += needs
    return packs


def _in_two_columns(tasks: Sequence[TaskDefinition]) -> bool:
    """Whether each task's name fits into half a line of a card."""
    return max(len(_numbered(task)) for task in tasks) <= _POCKET_LINE // 2 - 4


def _numbered(task: TaskDefinition) -> str:
    return f"{task.number} {task.name}"


def _first_pocket(card: Card, tasks: Sequence[TaskDefinition], cards: int) -> Markup:
    asked = " · ".join(line.say.replace("[WHO,] ", "").replace("WHO, ", "all, ") for line in _of(card, Topic.ASK))
    moved = " · ".join(line.say.replace("[WHO,] ", "") for line in _of(card, Topic.MOVE))
    rows = [("Ask: ", asked), ("Move: ", f"NAME, … {moved}"), ("Give work: ", f"{card.opening}, TASK")]
    rows.append(("Answer: ", "… confirmed · negative · say again · say again slowly"))
    halt = tag("div", tag("b", "“Stop”"), tag("p", "anybody, at any time; then “resume”"), class_="halt")
    work = f"Tasks: {', '.join(map(_numbered, tasks))}" if tasks else ""
    if cards > 1:
        work = "Tasks: on the next card" if cards == 2 else f"Tasks: on the next {cards - 1} cards"
    return joined(
        [
            tag("h2", _names(card)),
            halt,
            tag("ul", *(tag("li", tag("b", title), _slots(text)) for title, text in rows if text)),
            tag("p", work, class_="small") if work else Markup(),
            tag("p", "For example: ", card.example, class_="small"),
        ]
    )


def _next_pocket(tasks: Sequence[TaskDefinition], number: int, narrow: bool) -> Markup:
    """A card that has nothing but tasks."""
    rows = (tag("li", tag("b", str(task.number)), tag("span", task.name)) for task in tasks)
    kind = "pocket-tasks two" if narrow else "pocket-tasks"
    return joined([tag("h2", f"Tasks, card {number}"), tag("ul", *rows, class_=kind)])


def _of(card: Card, topic: Topic) -> list[Line]:
    return [line for line in card.calls if line.topic is topic]


def _slots(text: str) -> Markup:
    """The text with the words to be filled in marked."""
    return Markup(_SLOT.sub(r"<i>\g<0></i>", str(escaped(text))))
