"""The sentence forms: the single declarative source of what can be said, heard, understood and printed.

A pattern is made of words, `<slots>`, `[optional parts]`, `(alternatives|so)` and commas, where a speaker pauses.
Of alternatives the first is what our robots say; they understand all. A slot binds a field of the utterance or of
its statement.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from hvcpd.language import messages as m
from hvcpd.language.place_messages import PLACE_FORMS
from hvcpd.language.range_messages import RANGE_FORMS

OPENING = "(hi|hello) [<addressee>], i am <speaker> [, member of team <team>]"
"""The paper's 'Hi, [robot identifier], I am X'."""

SPELLING = "(hi|hello) [<addressee>], i spell, <letters>"
"""The opening of a robot whose name the others do not know."""

CALL = "[(hi|hello)] [<addressee> ,]"
"""The opening of a person who gives no name."""

CALL_TO = "[(hi|hello)] <addressee> ,"
"""A call without a name is for nobody in particular: one word alone is too easily heard in other talk."""

PLEASE = "[please]"
"""Before a request, and after a person's short request. Robots understand it and never say it."""

PASSED_ON = "[, change <count>]"
"""After a change of a task, or the report of one that was changed: its number. Only robots count changes."""

CHANGES = 9
"""Largest number of a task's changes, before the count starts again: a robot that has missed more than four in a row
takes the newest for an old one."""

_SAME_NAME = """addressee speaker team task place next first second confirmed with also then third reason other letters
count hundreds rest"""
SLOT_FIELDS = {slot: slot for slot in _SAME_NAME.split()} | {
    "number": "task",
    "metres": "distance_m",
    "away": "distance_m",
    "remark": "text",
    "volts": "battery_v",
}
"""Field of the utterance or of its statement that each slot binds; `other` is the quoted speaker in a relayed one, and
`confirmed` the task whose claim is confirmed in passing, `with` the second one of that claim."""
TWO_TASKS = (" and <also>", " and <then>")
"""A second task in the same sentence, if airtime is scarce; a team that encrypts names one at a time."""
AND_ALSO, AND_THEN = (f" [{words[1:]}]" for words in TWO_TASKS)


class Kind(Enum):
    """The users of a form: each form makes every listener's network larger, so a team can do without some."""

    CORE = "core"
    PEOPLE = "people"
    RELAY = "relay"
    SPELLING = "spelling"
    """Has a network of its own, in every voice: nobody knows the voice of an unknown name."""
    SEALED = "sealed"
    """For teams with a key: sentences may end in a seal or a code."""
    ENCRYPTED = "encrypted"
    """For teams with a key that encrypt their statements: code words may stand in a statement's place."""


OPEN_KINDS = frozenset(Kind) - {Kind.SEALED, Kind.ENCRYPTED}
"""The forms of a team without a key."""
SEALED_KINDS = OPEN_KINDS | {Kind.SEALED}
"""The forms of a team with a key."""


@dataclass(frozen=True)
class Form:
    """One sentence form: its pattern, the statement it makes, and its meaning in a person's words.

    `constants` are fields of the statement that the pattern fixes. A form with `will` reads the statement, a motion,
    back; a `relayed` one quotes it from another speaker; in a `spelled` one the letters are the speaker's name. A
    `casual` one is recognised only where it cannot spoil robots' sentences to each other: in a second pass over a
    sound. One with the slot `confirmed` confirms a claim in passing, or, if it `confirms_complete`, a report.
    """

    pattern: str
    statement: type[m.Statement] | None
    meaning: str
    kind: Kind = Kind.CORE
    constants: Mapping[str, object] = field(default_factory=dict)
    will: bool = False
    relayed: bool = False
    spelled: bool = False
    casual: bool = False
    confirms_complete: bool = False


_MOTIONS: tuple[tuple[str, type[m.Statement], str, dict[str, object]], ...] = (
    (f"come back {PLEASE}", m.ComeBack, "Drive to where you started.", {}),
    (f"move forward <metres> {PLEASE}", m.MoveBy, "Drive straight on.", {"back": False}),
    (f"move back <metres> {PLEASE}", m.MoveBy, "Drive backward.", {"back": True}),
    (f"turn left {PLEASE}", m.TurnBy, "Turn by a right angle.", {"angle_deg": 90.0}),
    (f"turn right {PLEASE}", m.TurnBy, "Turn by a right angle.", {"angle_deg": -90.0}),
    (f"turn around {PLEASE}", m.TurnBy, "Turn by half a circle.", {"angle_deg": 180.0}),
)

_QUESTIONS: tuple[tuple[str, type[m.Statement], str], ...] = (
    (f"what are you doing {PLEASE}", m.WhatDoing, "What is your task?"),
    (f"who is here {PLEASE}", m.WhoHere, "Everybody who is asked says its name."),
    (f"what is left {PLEASE}", m.WhatLeft, "Which tasks are not done yet? One robot answers."),
)

_IN_PASSING: tuple[tuple[str, type[m.Statement], str], ...] = (
    (f"i will complete task <number>{AND_ALSO}", m.Claim, "And I take this task."),
    ("i will complete task <number>, <away>", m.Claim, "And I take this task, unless you are nearer."),
    (f"task <number>{AND_ALSO} complete", m.Completed, "And this task is done."),
    (
        f"task <number>{AND_ALSO} complete, i will complete task <next>{AND_THEN}",
        m.Completed,
        "And this task is done, and I take the next.",
    ),
)
"""The rest of a sentence that begins with a confirmation, if many want to speak."""

_READ_BACK: tuple[tuple[str, bool, str], ...] = (
    ("<number>", False, "I heard what you said of this task: go ahead."),
    ("<number> complete", True, "I heard that you have done this task."),
    ("<number> and <also>", False, "I heard your claim of these two: go ahead."),
    ("<number> and <also> complete", True, "I heard that you have done these two."),
)

_CHANGES: tuple[tuple[str, str, bool], ...] = (
    ("task <number> again", "Do this task once more.", False),
    (f"{PLEASE} skip task <number>", "Leave this task out this time.", True),
)

_CORE: tuple[Form, ...] = (
    Form(OPENING, None, "A greeting: now others know that I am here."),
    Form(f"{OPENING}, i will complete task <number>", m.Claim, "I take this task; after an order: I read it back."),
    Form(f"{OPENING}, i will complete task <number> and <also>", m.Claim, "I take these two tasks."),
    Form(f"{OPENING}, i will complete task <number>, <away>", m.Claim, "I take this task, unless you are nearer."),
    Form(f"{OPENING}, i will <task>", m.Claim, "I take this task; after an order: I read it back."),
    Form(f"{OPENING}, {PLEASE} complete task <number>", m.Order, "Please do this task."),
    Form(f"{OPENING}, {PLEASE} <task>", m.Order, "Please do this task."),
    Form(f"{OPENING}, completing task <number>", m.Working, "I am on this task now."),
    Form(f"{OPENING}, completing task, <task>", m.Working, "I am on this task now."),
    Form(f"{OPENING}, task <number> complete {PASSED_ON}", m.Completed, "This task is done."),
    Form(f"{OPENING}, task <number> and <also> complete", m.Completed, "These two tasks are done."),
    Form(
        f"{OPENING}, task <number>{AND_ALSO} complete, i will complete task <next>{AND_THEN}",
        m.Completed,
        "This task is done, and I take the next one.",
    ),
    *(
        Form(f"{OPENING}, {words} {PASSED_ON}", m.Change, means, constants={"skip": skip})
        for words, means, skip in _CHANGES
    ),
    Form(f"{OPENING}, task <number> failed", m.Failed, "I gave this task up: somebody else may take it."),
    Form(
        f"{OPENING}, task <number> failed, <reason>",
        m.Failed,
        "I gave this task up for this reason.",
    ),
    Form(f"{OPENING}, i cannot complete task <number>", m.Unable, "I lack the means for it, or it failed before."),
    Form(f"{OPENING}, i cannot <task>", m.Unable, "I lack the means for it, or it failed before."),
    Form(f"{OPENING}, i do not know task <number>", m.Unknown, "I have no such task."),
    Form(f"{OPENING}, i am busy", m.Busy, "I am busy: ask me later."),
    Form(f"{OPENING}, confirmed", m.Confirmed, "What you said is right: go ahead.", constants={"complete": False}),
    *(
        Form(f"{OPENING}, confirmed [task] {words}", m.Confirmed, means, constants={"complete": complete})
        for words, complete, means in _READ_BACK
    ),
    *(
        Form(
            f"{OPENING}, confirmed <confirmed> [and <with>]{' complete' * complete}, {words}",
            statement,
            f"{'I heard that you have done this task.' if complete else 'I heard your claim: go ahead.'} {means}",
            confirms_complete=complete,
        )
        for complete in (False, True)
        for words, statement, means in _IN_PASSING
    ),
    Form(f"{OPENING}, negative", m.Negative, "What you said is wrong: don't."),
    Form(f"{OPENING}, {PLEASE} say again", m.SayAgain, "I did not understand you.", constants={"slowly": False}),
    Form(
        f"{OPENING}, {PLEASE} say again slowly", m.SayAgain, "Once more, and more slowly.", constants={"slowly": True}
    ),
    Form(f"{OPENING}, i did not understand", m.NotUnderstood, "It was not clear."),
    Form(f"{OPENING}, <remark>", m.Remark, "A remark from the task file."),
    Form(f"{OPENING}, {PLEASE} stop {PLEASE}", m.Stop, "Halt at once, and stay halted."),
    Form(f"[<addressee>] {PLEASE} stop {PLEASE}", m.Stop, "Halt at once, and stay halted. Anybody may say it."),
    Form(f"{OPENING}, i have stopped", m.Stopped, "I have halted.", constants={"forgot": False, "waits": False}),
    Form(
        f"{OPENING}, i have lost my memory, i have stopped",
        m.Stopped,
        "I have lost my memory: I stand until somebody says resume.",
        constants={"forgot": True, "waits": False},
    ),
    Form(
        f"{OPENING}, i have stopped until you say resume",
        m.Stopped,
        "I have stood for a minute, and go on only when somebody says resume.",
        constants={"forgot": False, "waits": True},
    ),
    Form(f"{OPENING}, {PLEASE} resume {PLEASE}", m.Resume, "After a stop: you may take on tasks again."),
    Form(f"[<addressee>] {PLEASE} resume {PLEASE}", m.Resume, "After a stop: you may take on tasks again."),
    Form(f"{OPENING}, {PLEASE} what is left {PLEASE}", m.WhatLeft, "Which tasks are not done yet? One robot answers."),
    Form(f"{OPENING}, nothing left", m.Left, "Every task is done.", constants={"more": False}),
    Form(
        f"{OPENING}, task <first> [and <second> [and <third>]] left",
        m.Left,
        "These tasks are not done yet, and no others.",
        constants={"more": False},
    ),
    Form(
        f"{OPENING}, task <first> [and <second> [and <third>]] and more left",
        m.Left,
        "These tasks are not done yet, and others too.",
        constants={"more": True},
    ),
    Form(f"{OPENING}, i am free", m.Free, "I have no task."),
    Form(f"{OPENING}, i am leaving", m.Leaving, "I go, and give back what I had claimed."),
    Form(f"{OPENING}, my name is taken", m.NameTaken, "Somebody else uses my name: I do nothing under it."),
    Form(f"{OPENING}, sealed message", m.SealedMessage, "A message for robots with the team's key."),
)

_PLACES, _RANGES = (
    tuple(Form(f"{OPENING}, {words}", kind, means, constants=fixed) for words, kind, means, fixed in rows)
    for rows in (PLACE_FORMS, RANGE_FORMS)
)

_REPORT = "Each robot in turn says its team, its task and its battery."
_DOINGS: tuple[tuple[str, m.Doing, str], ...] = (
    ("i am free", m.Doing.FREE, "I have no task."),
    ("i am busy", m.Doing.BUSY, "I am doing something else."),
    ("i have stopped", m.Doing.STOPPED, "I have halted."),
    ("completing task <number>", m.Doing.WORKING, "I am on this task now."),
)

_REPORTS: tuple[Form, ...] = (
    Form(f"{CALL_TO} {PLEASE} report {PLEASE}", m.ReportWanted, _REPORT, Kind.PEOPLE),
    Form(f"{OPENING}, {PLEASE} report {PLEASE}", m.ReportWanted, _REPORT, Kind.PEOPLE),
    *(
        Form(f"{OPENING}, report, {words} [, battery <volts> volts]", m.Report, means, Kind.PEOPLE, {"doing": doing})
        for words, doing, means in _DOINGS
    ),
)

_PEOPLE: tuple[Form, ...] = (
    *_REPORTS,
    *(Form(f"{CALL} {PLEASE} {words}", statement, means, Kind.PEOPLE) for words, statement, means in _QUESTIONS),
    *(
        Form(f"{OPENING}, {PLEASE} {words}", statement, means, Kind.PEOPLE)
        for words, statement, means in _QUESTIONS
        if statement is not m.WhatLeft
    ),
    *(Form(f"{CALL} {PLEASE} {words}", kind, means, Kind.PEOPLE, fixed) for words, kind, means, fixed in _MOTIONS),
    *(Form(f"{OPENING}, {PLEASE} {words}", kind, means, Kind.PEOPLE, fixed) for words, kind, means, fixed in _MOTIONS),
    *(
        Form(f"{OPENING}, i will {words}", kind, "I read this motion back.", Kind.PEOPLE, fixed, will=True)
        for words, kind, _, fixed in _MOTIONS
    ),
)

RELAYABLE = (
    m.Claim,
    m.Order,
    m.Working,
    m.Completed,
    m.Failed,
    m.Unable,
    m.Unknown,
    m.Busy,
    m.Free,
    m.WhatDoing,
    m.Confirmed,
    m.Negative,
    m.SealedMessage,
)
"""Statements passed on for another speaker, each in a form of its own."""
SAID_TWICE = ("next", "confirmed", "also", "away")
"""Slots of forms that say two things at once: those are not passed on."""
_RELAYS: tuple[Form, ...] = tuple(
    Form(
        f"{OPENING}, <other> says, {form.pattern[len(OPENING) + 2 :]}",
        form.statement,
        "I pass on what somebody else said.",
        Kind.RELAY,
        form.constants,
        relayed=True,
    )
    for form in (*_CORE, *_PEOPLE)
    if form.statement in RELAYABLE
    and form.pattern.startswith(OPENING)
    and not any(f"<{slot}>" in form.pattern for slot in SAID_TWICE)
)

_SPELLED: tuple[Form, ...] = (
    Form(SPELLING, m.Spelled, "My name, letter by letter.", Kind.SPELLING, {"ask": False}, spelled=True),
    Form(
        f"{SPELLING}, spell your name",
        m.Spelled,
        "My name; and spell yours, if I may not know it.",
        Kind.SPELLING,
        {"ask": True},
        spelled=True,
    ),
)

_SEALED: tuple[Form, ...] = (
    Form(f"{OPENING}, i do not trust that", m.Distrusted, "Who said that? Its seal or code is wrong.", Kind.SEALED),
)

_WITHOUT_A_NAME: tuple[tuple[str, type[m.Statement], str, dict[str, object]], ...] = (
    (f"{PLEASE} complete task <number> {PLEASE}", m.Order, "Please do this task.", {}),
    (f"{PLEASE} <task> {PLEASE}", m.Order, "Please do this task.", {}),
    ("confirmed", m.Confirmed, "What you said is right: go ahead.", {"complete": False}),
    ("negative", m.Negative, "What you said is wrong: don't.", {}),
)
"""What otherwise needs the speaker's name."""

SMALL_STEP_M = 0.5
"""Distance of a motion without a stated one: the least that can be said."""

_CASUAL: tuple[Form, ...] = (
    Form("(hi|hello) <addressee>", m.Hail, "Everybody who is asked says its name.", Kind.PEOPLE, casual=True),
    *(
        Form(f"{CALL_TO} {words}", statement, means, Kind.PEOPLE, constants, casual=True)
        for words, statement, means, constants in _WITHOUT_A_NAME
    ),
    *(
        Form(
            f"{CALL} {PLEASE} move {words} {PLEASE}",
            m.MoveBy,
            "Drive half a metre.",
            Kind.PEOPLE,
            {"back": words == "back", "distance_m": SMALL_STEP_M},
            casual=True,
        )
        for words in ("forward", "back")
    ),
)
"""Sentences of people who have not read the card."""

FORMS: tuple[Form, ...] = (*_CORE, *_PLACES, *_RANGES, *_PEOPLE, *_RELAYS, *_SPELLED, *_SEALED, *_CASUAL)
