"""The sentence forms: the single declarative source of what can be said, heard, understood and printed.

A pattern is made of words, `<slots>`, `[optional parts]`, `(alternatives|so)` and commas, where a speaker pauses.
Of alternatives the first is what our robots say; they understand all. A slot binds a field of the utterance or
of its statement.
"""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.language import messages as m

OPENING = "(hi|hello) [<addressee>], i am <speaker> [, member of team <team>]"
"""The paper's 'Hi, [robot identifier], I am X'."""

SLOT_FIELDS = {
    "addressee": "addressee",
    "speaker": "speaker",
    "team": "team",
    "number": "task",
    "task": "task",
    "remark": "text",
}
"""Which field of the utterance or of its statement a slot binds."""


@dataclass(frozen=True)
class Form:
    """One sentence form: its pattern, the statement it makes, and its meaning in a person's words."""

    pattern: str
    statement: type[m.Statement] | None
    meaning: str


FORMS: tuple[Form, ...] = (
    Form(OPENING, None, "A greeting: whoever hears it knows that I am here."),
    Form(f"{OPENING}, i will complete task <number>", m.Claim, "I take this task; after an order: I read it back."),
    Form(f"{OPENING}, i will <task>", m.Claim, "I take this task; after an order: I read it back."),
    Form(f"{OPENING}, complete task <number>", m.Order, "Please do this task."),
    Form(f"{OPENING}, <task>", m.Order, "Please do this task."),
    Form(f"{OPENING}, completing task <number>", m.Working, "I am at this task now."),
    Form(f"{OPENING}, completing task, <task>", m.Working, "I am at this task now."),
    Form(f"{OPENING}, task <number> complete", m.Completed, "This task is done."),
    Form(f"{OPENING}, task <number> failed", m.Failed, "I gave this task up: somebody else may take it."),
    Form(f"{OPENING}, i cannot complete task <number>", m.Unable, "I do not know this task, or cannot do it now."),
    Form(f"{OPENING}, i cannot <task>", m.Unable, "I do not know this task, or cannot do it now."),
    Form(f"{OPENING}, confirmed", m.Confirmed, "What you said is right: go ahead."),
    Form(f"{OPENING}, negative", m.Negative, "What you said is wrong: don't."),
    Form(f"{OPENING}, say again", m.SayAgain, "I did not understand you."),
    Form(f"{OPENING}, <remark>", m.Remark, "A remark that a task has its robot make."),
    Form(f"{OPENING}, stop", m.Stop, "Halt at once, and stay halted."),
    Form("[<addressee>] stop", m.Stop, "Halt at once, and stay halted. Anybody may say it."),
    Form(f"{OPENING}, i have stopped", m.Stopped, "I have halted."),
    Form(f"{OPENING}, resume", m.Resume, "After a stop: you may take on tasks again."),
    Form("[<addressee>] resume", m.Resume, "After a stop: you may take on tasks again."),
)
