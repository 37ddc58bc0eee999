"""The names that a robot knows, and everything it needs to understand one more."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from hvcpd.assembly.make import make_phrasebook_and_recogniser, voices_of
from hvcpd.assembly.plan import RobotPlan
from hvcpd.assembly.sound import Sound
from hvcpd.config.settings import MAX_KNOWN_NAMES
from hvcpd.config.tasks import TaskRepository
from hvcpd.errors import PhraseError
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.recognition.stages import SpeechRecogniser
from hvcpd.synthesis.likeness import sounds_alike


class NameRegistry:
    """The names that one robot knows: those given in advance, and those it learns; it forgets the oldest of these."""

    def __init__(self, plan: RobotPlan, sound: Sound, settled: Iterable[str] = ()) -> None:
        """`settled`: the plan's names that it knows whichever people are enrolled."""
        self._plan = plan
        self._sound = sound
        self._given = plan.team.names
        self.people = plan.hearing.people
        self._guests = set(self.people).difference(name.lower() for name in (plan.role.name, *settled))
        """Names that are known only because they are enrolled, in lower case."""
        self.names = plan.team.names

    @property
    def voices(self) -> dict[str, str]:
        """The voices of all who are known, by name in lower case."""
        return voices_of(self.names, self._sound, self.people)

    def knows(self, name: str) -> bool:
        """Whether a name is known, whatever its case."""
        return name.lower() in (known.lower() for known in self.names)

    def retask(self, tasks: TaskRepository) -> tuple[Phrasebook, SpeechRecogniser]:
        """The phrasebook and recogniser for these tasks, and for the earlier ones, which the robot may be about to
        mention, unless one is spoken like a new one that is written otherwise. Takes seconds. Raises PhraseError for
        words that clash."""
        before = self._plan.tasks
        said = (*tasks.tasks, *(task for task in before.tasks if task not in tasks.tasks))
        skills = (*tasks.skills, *(skill for skill in before.skills if skill not in tasks.skills))
        plan = replace(self._plan, tasks=replace(tasks, tasks=said, skills=skills))
        try:
            ready = make_phrasebook_and_recogniser(plan, self.names, self._sound)
        except PhraseError:
            plan = replace(self._plan, tasks=tasks)
            ready = make_phrasebook_and_recogniser(plan, self.names, self._sound)
        self._plan = plan
        return ready

    def mark_given(self, name: str) -> None:
        """Treat a learned name as given: it is no longer forgotten."""
        known = next(each for each in self.names if each.lower() == name.lower())
        if known not in self._given:
            self._given = (*self._given, known)
            self._guests.add(name.lower())

    def forget_people(self) -> None:
        """Forget the names of people who are no longer enrolled."""
        gone = self._guests.difference(self.people)
        self._guests -= gone
        self._given = tuple(name for name in self._given if name.lower() not in gone)
        self.names = tuple(name for name in self.names if name.lower() not in gone)

    def learn(self, name: str, given: bool = False) -> tuple[Phrasebook, SpeechRecogniser]:
        """The phrasebook and recogniser for one more name. Takes seconds. A `given` name is never forgotten. Raises
        PhraseError for a name that sounds like a known one, or is a word of the phrasebook."""
        rival = next((known for known in self.names if sounds_alike(name, known, self._sound.lexicon)), None)
        if rival is not None:
            raise PhraseError(f"the name '{name}' sounds like '{rival}': that robot needs another one")
        always = (*self._given, name) if given else self._given
        learned = [known for known in (*self.names, name) if known not in always]
        room = max(MAX_KNOWN_NAMES - len(always), 0 if given else 1)
        names = (*always, *learned[len(learned) - min(room, len(learned)) :])
        ready = make_phrasebook_and_recogniser(self._plan, names, self._sound)
        self.names, self._given = names, always
        if given:
            self._guests.add(name.lower())
        return ready
