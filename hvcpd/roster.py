"""The names that a robot knows, and what it needs to understand one more."""

from __future__ import annotations

from hvcpd.assembly import RobotPlan, Sound, make_phrasebook_and_ears
from hvcpd.config.settings import MAX_KNOWN_NAMES
from hvcpd.errors import PhraseError
from hvcpd.faculties import Ears
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.synthesis.likeness import sounds_alike


class Roster:
    """The names that one robot knows: those it was told, and those that it learns, the oldest of which it forgets."""

    def __init__(self, plan: RobotPlan, sound: Sound) -> None:
        self._plan = plan
        self._sound = sound
        self._told = plan.names
        self.names = plan.names

    def learn(self, name: str, told: bool = False) -> tuple[Phrasebook, Ears]:
        """What a robot needs to understand one name more. Takes seconds. A name that it was `told` is not forgotten.
        Raises PhraseError for a name that sounds like a known one, or is a word of the phrasebook."""
        rival = next((known for known in self.names if sounds_alike(name, known, self._sound.lexicon)), None)
        if rival is not None:
            raise PhraseError(f"the name '{name}' sounds like '{rival}': that robot needs another one")
        always = (*self._told, name) if told else self._told
        learned = [known for known in (*self.names, name) if known not in always]
        room = max(MAX_KNOWN_NAMES - len(always), 0 if told else 1)
        names = (*always, *learned[len(learned) - min(room, len(learned)) :])
        ready = make_phrasebook_and_ears(self._plan, names, self._sound)
        self.names, self._told = names, always
        return ready
