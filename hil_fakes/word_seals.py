"""Seals at the level of words: each robot of a mission seals and judges sentences, and remembers its counters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from hvcpd.config.tasks import TaskDefinition
from hvcpd.language import messages as m
from hvcpd.language.forms import Kind
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.robot.sealing import Sealing
from hvcpd.security.guard import Guard
from hvcpd.security.keys import KeyRing
from hvcpd.security.trust import Trust


def keyed_book(names: Iterable[str], tasks: Iterable[TaskDefinition]) -> Phrasebook:
    """The phrasebook of a team with a key."""
    given = tuple(tasks)
    numbers = tuple(task.number for task in given)
    task_names = tuple(task.name for task in given)
    return Phrasebook(Vocabulary(tuple(names), ("plant",), task_names, numbers, kinds=frozenset(Kind)))


class WordSeals:
    """One object for a whole team; each robot has its own guard, which is lost when it is switched off."""

    def __init__(self, book: Phrasebook, keys: KeyRing, encrypts: bool = False) -> None:
        self.book = book
        self.keys = keys
        self.encrypts = encrypts
        self.verdicts: Counter[Trust] = Counter()
        self._on: dict[str, Sealing] = {}
        self.counters: dict[str, dict[str, int]] = {}
        """The counters that each robot has saved, by whose they are."""

    def switch_on(self, name: str, roster: Iterable[str] = ()) -> None:
        """A robot begins with its saved counters; the robots of the `roster` have the key."""
        guard = Guard(name, self.keys, self.counters.setdefault(name, {}))
        self._on[name] = Sealing(guard, self.encrypts, roster)

    def marked(self, name: str, utterance: m.Utterance, now: float) -> m.Utterance:
        """The sentence as the robot says it: with its seal, or encrypted."""
        said = self._on[name].marked(utterance, self.book, now)
        self._save(name)
        return said

    def judge(self, name: str, utterance: m.Utterance, now: float) -> tuple[m.Utterance, Trust]:
        """The sentence as the robot understands it, and how far it trusts that."""
        opened, verdict = self._on[name].judge(utterance, self.book, now)
        self._save(name)
        if utterance.mark is not None:
            self.verdicts[verdict.trust] += 1
        return opened, verdict.trust

    def _save(self, name: str) -> None:
        self.counters[name] |= self._on[name].guard.saves()
