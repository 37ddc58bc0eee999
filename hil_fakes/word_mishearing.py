"""Mishearing at the level of words: a recogniser mistakes one word of a sentence for another."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace

from hvcpd.language import messages as m


def misheard(names: Sequence[str], numbers: Sequence[int], u: m.Utterance, rng: random.Random) -> m.Utterance:
    """The sentence with one word wrong: a number, a name, or how a task ended; `names` and `numbers` are the team's."""
    if isinstance(u.statement, m.Spelled):
        return u  # every letter wrong is a name that nobody has; the recogniser's own threshold keeps those away
    kinds = ["speaker"] if u.speaker is not None else []
    kinds += ["addressee"] if isinstance(u.addressee, m.ToRobot) else []
    s = u.statement
    if isinstance(s, m.Claim | m.Working | m.Completed | m.Failed | m.Change) and isinstance(s.task, m.TaskByNumber):
        kinds += ["number", "number"]
    if isinstance(s, m.Completed) and s.next is None:
        kinds += ["failed"]
    kind = rng.choice(kinds) if kinds else "none"
    match kind:
        case "speaker":
            return replace(u, speaker=rng.choice(names))
        case "addressee":
            return replace(u, addressee=m.ToRobot(rng.choice(names)))
        case "number":
            number = m.TaskByNumber(rng.choice(numbers))
            return replace(u, statement=replace(s, task=number))  # type: ignore[type-var]
        case "failed" if isinstance(s, m.Completed):
            return replace(u, statement=m.Failed(s.task))
        case _:
            return u
