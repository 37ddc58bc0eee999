"""Puts one robot together from its settings: the only place that knows all rooms of the house."""

from __future__ import annotations

import os
import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hvcpd.config.settings import DEFAULT_TEAMS as DEFAULT_TEAMS
from hvcpd.config.tasks import SayAction, TaskRepository
from hvcpd.coordination.actions import Role
from hvcpd.coordination.coordination import Coordination
from hvcpd.hardware.kinematics import BURGER, Drive, Odometry
from hvcpd.hardware.navigator import Navigator
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.performer import Performer
from hvcpd.ports import Pose, Samples
from hvcpd.recognition.recogniser import Recogniser
from hvcpd.recognition.urgent import UrgentSpotter, UrgentTemplates
from hvcpd.robot import Acoustics, Robot
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import UnitCache
from hvcpd.synthesis.voices import VOICES, Voice, voice_for

SLOW = 0.8
"""Of the usual rate, when a robot is asked to say something again slowly; the recogniser's steps span 0.5 to 2."""

STOP, STOP_RIVAL = "stop", "stopped"
"""The word that halts over any talk, and the one of the phrasebook that begins with it and does not."""


@dataclass(frozen=True)
class Sound:
    """Where pronunciations come from and where rendered units are kept."""

    lexicon: Lexicon
    cache: UnitCache | None = None


def make_sound(lexicon: Path | None = None, cache_folder: Path | None = None) -> Sound:
    """Pronunciations (with a lexicon file of the user's own, if any) and a cache of rendered units on disk.

    Raises ConfigError with every fault of the lexicon file.
    """
    return Sound(Lexicon.load(lexicon), UnitCache(cache_folder) if cache_folder is not None else None)


def user_cache_folder() -> Path | None:
    """Where a person's commands keep rendered units, by the XDG base directories; None without a home."""
    base = os.environ.get("XDG_CACHE_HOME")
    try:
        return (Path(base) if base else Path.home() / ".cache") / "hvcpd" / "units"
    except RuntimeError:
        return None


@dataclass(frozen=True)
class RobotPlan:
    """Everything that tells one robot from another. `names` are all names known beforehand, its own among them."""

    role: Role
    names: tuple[str, ...]
    tasks: TaskRepository
    start: Pose
    seed: int
    teams: tuple[str, ...] = DEFAULT_TEAMS
    remembered: Mapping[int, tuple[str, str | None]] | None = None
    acoustics: Acoustics | None = None
    stopped: bool = False
    """It was stopped when it was switched off."""
    drive: Drive = BURGER


def make_phrasebook(names: Sequence[str], teams: Iterable[str], tasks: TaskRepository) -> Phrasebook:
    """The phrasebook of a team. Raises PhraseError when its words clash."""
    remarks = {a.text: None for task in tasks.tasks for a in task.actions if isinstance(a, SayAction)}
    return Phrasebook(
        Vocabulary(
            names=tuple(dict.fromkeys(names)),
            teams=tuple(dict.fromkeys(team.lower() for team in teams)),
            tasks=(*(task.name for task in tasks.tasks), *tasks.other_tasks),
            numbers=tuple(task.number for task in tasks.tasks),
            remarks=tuple(remarks),
        )
    )


def make_recogniser(phrasebook: Phrasebook, names: Iterable[str], sound: Sound) -> Recogniser:
    """A recogniser for the voices of these robots: templates are the very signals that their synthesizers make."""
    voices = {voice_for(name).name: voice_for(name) for name in names}
    bank = {name: templates(phrasebook, v, sound) for name, v in voices.items()}
    return Recogniser(phrasebook.graph, bank, urgent=make_urgent(sound))


def make_urgent(sound: Sound) -> UrgentSpotter:
    """Hears "stop" over other voices, in any of our voices: a person may have each of them."""
    speakers = {voice.name: Speaker(voice, sound.lexicon, sound.cache) for voice in VOICES}
    finals = {w: {name: s.templates(w)[1:2] for name, s in speakers.items()} for w in (STOP, STOP_RIVAL)}
    return UrgentSpotter(UrgentTemplates(finals[STOP], finals[STOP_RIVAL], frozenset((STOP, STOP_RIVAL))))


def templates(phrasebook: Phrasebook, voice: Voice, sound: Sound) -> dict[str, list[Samples]]:
    """Every word of the phrasebook in one voice."""
    return templates_of(phrasebook.graph.words, voice, sound)


def templates_of(words: Iterable[str], voice: Voice, sound: Sound) -> dict[str, list[Samples]]:
    """These words in one voice."""
    speaker = Speaker(voice, sound.lexicon, sound.cache)
    return {word: speaker.templates(word) for word in words}


def make_robot(plan: RobotPlan, sound: Sound) -> Robot:
    """A whole robot. It listens for the voices of all names but its own."""
    phrasebook = make_phrasebook(plan.names, (*plan.teams, *([plan.role.team] if plan.role.team else [])), plan.tasks)
    others = [name for name in plan.names if name.lower() != plan.role.name.lower()]
    coordination = Coordination(
        plan.role, plan.tasks.tasks, random.Random(plan.seed), remembered=plan.remembered, stopped=plan.stopped
    )
    voice = voice_for(plan.role.name)
    return Robot(
        coordination,
        phrasebook,
        make_recogniser(phrasebook, others or plan.names, sound),
        Speaker(voice, sound.lexicon, sound.cache),
        Odometry(plan.start, plan.drive),
        Performer(Navigator(plan.drive)),
        plan.acoustics,
        Speaker(replace(voice, rate=SLOW * voice.rate), sound.lexicon, sound.cache),
    )
