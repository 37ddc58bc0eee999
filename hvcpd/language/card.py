"""The card on the wall: what can be said, made from the forms and the vocabulary, for people."""

from __future__ import annotations

import html
from dataclasses import dataclass

from hvcpd.language.forms import CALL, CALL_TO, FORMS, OPENING, PLEASE, Form
from hvcpd.language.messages import ToAll, ToRobot, ToTeam
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.spelling import WORD_OF

_PLACEHOLDERS = {
    "<addressee>": "WHO",
    "<speaker>": "NAME",
    "<team>": "TEAM",
    "<number>": "NUMBER",
    "<task>": "TASK",
    "<remark>": "REMARK",
    "<next>": "NUMBER",
    "<first>": "NUMBER",
    "<second>": "NUMBER",
    "<third>": "NUMBER",
    "<metres>": "DISTANCE",
    "<other>": "NAME",
    "<letters>": "LETTERS",
    "<volts>": "VOLTS",
}


@dataclass(frozen=True)
class Line:
    """One way to say something, with words to be filled in written in capitals, and what it means."""

    say: str
    meaning: str


@dataclass(frozen=True)
class Card:
    """The whole card: what anybody may call, how every sentence opens, how it goes on, and the words to fill in."""

    calls: tuple[Line, ...]
    opening: str
    statements: tuple[Line, ...]
    words: tuple[tuple[str, tuple[str, ...]], ...]
    example: str


def make_card(phrasebook: Phrasebook) -> Card:
    """The card of a team's phrasebook."""
    vocabulary = phrasebook.vocabulary
    calls, statements = [], []
    called = {(_plain(f).removeprefix(CALL).removeprefix(CALL_TO).strip(), f.meaning) for f in FORMS if _is_call(f)}
    for form in FORMS:
        pattern = _plain(form)
        if form.kind not in vocabulary.kinds or form.relayed or form.will:
            continue
        if "<remark>" in form.pattern and not vocabulary.remarks:
            continue
        if "<task>" in form.pattern and not vocabulary.tasks:
            continue
        if form.spelled:
            spelled = _written(pattern.split(", ", 1)[1])
            statements.append(Line(f"instead of the name: {spelled}", form.meaning))
        elif pattern.startswith(OPENING):
            rest = pattern[len(OPENING) :].lstrip(", ")
            if rest and (rest, form.meaning) not in called:
                statements.append(Line(_written(rest), form.meaning))
        else:
            calls.append(Line(_call(pattern), form.meaning))
    addressees = [_addressee(value) for value in phrasebook.slots["addressee"]]
    words: list[tuple[str, tuple[str, ...]]] = [
        ("WHO", tuple(addressees)),
        ("NAME", vocabulary.names),
        ("TEAM", vocabulary.teams),
        ("NUMBER", tuple(" ".join(spoken) for spoken in phrasebook.slots["number"].values())),
        ("TASK", vocabulary.tasks),
        ("DISTANCE", tuple(" ".join(spoken) for spoken in phrasebook.slots["metres"].values())),
        ("REMARK", vocabulary.remarks),
        ("LETTERS", tuple(word for letter, word in WORD_OF.items() if letter.isalpha())),
    ]
    return Card(
        tuple(calls),
        _written(OPENING).replace("(hi|hello)", "Hi"),
        tuple(statements),
        tuple((slot, entries) for slot, entries in words if entries),
        _example(phrasebook),
    )


def _plain(form: Form) -> str:
    """The pattern without what is only politeness: the card says once where "please" may stand."""
    return " ".join(form.pattern.replace(PLEASE, "").split())


def _example(phrasebook: Phrasebook) -> str:
    names, tasks = phrasebook.vocabulary.names, phrasebook.vocabulary.tasks
    if len(names) < 2 or not tasks:
        return "Hi all, I am " + (names[0] if names else "…")
    return f"Hi {names[0]}, I am {names[1]}, {tasks[-1]}"


def _addressee(value: object) -> str:
    match value:
        case ToAll():
            return "all"
        case ToTeam(team):
            return f"team {team}"
        case ToRobot(name):
            return name
        case _:
            return str(value)


def _call(pattern: str) -> str:
    """A call as the card has it: "[WHO,] come back"."""
    return _written(pattern.replace(CALL, "[<addressee>,]").replace(CALL_TO, "<addressee>,"))


def _is_call(form: Form) -> bool:
    return form.pattern.startswith((CALL, CALL_TO))


def _written(pattern: str) -> str:
    for slot, placeholder in _PLACEHOLDERS.items():
        pattern = pattern.replace(slot, placeholder)
    pattern = pattern.replace(" [, ", "[, ").replace(" i ", " I ")
    return "I " + pattern[2:] if pattern.startswith("i ") else pattern


HELLO = (
    '"Hello" is understood as "Hi", and "please" before what you ask for; '
    "parts in [brackets] may be left out; pause a little at the commas."
)


def as_text(card: Card) -> str:
    """For the terminal, within 80 columns where the words allow it."""
    width = max(len(line.say) for line in (*card.calls, *card.statements)) + 2
    lines = ["What can be said", "", "Anybody, at any time:"]
    lines += [f"  {line.say:<{width}}{line.meaning}" for line in card.calls]
    lines += ["", f"Everything else opens with:  {card.opening}", "and goes on with nothing, or one of:"]
    lines += [f"  {line.say:<{width}}{line.meaning}" for line in card.statements]
    lines += ["", "Words to fill in:"]
    lines += [f"  {slot:<10}{', '.join(entries)}" for slot, entries in card.words]
    lines += ["", HELLO, f"For example:  {card.example}", ""]
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
    out += ["", HELLO, "", f"For example: *{_md(card.example)}*", ""]
    return "\n".join(out)


def _md(text: str) -> str:
    return text.replace("|", "\\|").replace("[", "\\[").replace("]", "\\]")


_STYLE = """
@page { size: A4; margin: 14mm }
:root { color-scheme: light dark }
body { font: 15px/1.45 system-ui, sans-serif; max-width: 46rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 2rem; margin: 0 0 .5rem } h2 { font-size: 1.1rem; margin: 1.6rem 0 .4rem }
table { border-collapse: collapse; width: 100% }
caption { text-align: left; padding-bottom: .4rem }
th, td { text-align: left; vertical-align: top; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid #8886 }
td:first-child { font-weight: 600; width: 45% }
.call td:first-child { font-size: 1.3rem; color: #b3261e }
@media (prefers-color-scheme: dark) { .call td:first-child { color: #ff8a80 } }
.opening { font-size: 1.25rem; font-weight: 600; padding: .6rem .8rem; border-left: .3rem solid #2e7d32 }
dt { font-weight: 600; margin-top: .5rem } dd { margin: 0 }
@media print { body { margin: 0; font-size: 12px } }
"""


def as_html(card: Card) -> str:
    """One self-contained page, to be printed on A4."""
    e = html.escape

    def table(lines: tuple[Line, ...], kind: str) -> str:
        rows = "".join(f"<tr><td>{e(line.say)}</td><td>{e(line.meaning)}</td></tr>" for line in lines)
        head = "<thead><tr><th scope='col'>Say</th><th scope='col'>It means</th></tr></thead>"
        return f"<table class='{kind}'>{head}<tbody>{rows}</tbody></table>"

    words = "".join(f"<dt>{slot}</dt><dd>{e(', '.join(entries))}</dd>" for slot, entries in card.words)
    return (
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<title>What can be said</title><style>{_STYLE}</style></head><body><main><h1>What can be said</h1>"
        f"<h2>Anybody, at any time</h2>{table(card.calls, 'call')}"
        f"<h2>Everything else opens with</h2><p class='opening'>{e(card.opening)}</p>"
        f"<h2>and goes on with nothing, or one of</h2>{table(card.statements, 'statement')}"
        f"<h2>Words to fill in</h2><dl>{words}</dl><p>{e(HELLO)}</p>"
        f"<p>For example: <q>{e(card.example)}</q></p></main></body></html>\n"
    )
