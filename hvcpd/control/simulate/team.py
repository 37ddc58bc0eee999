"""A team as the commands load it: names, tasks and pronunciations."""

from __future__ import annotations

import argparse
import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.assembly.voice_assignment import assign_voices
from hvcpd.config.document import place_of
from hvcpd.config.settings import Settings
from hvcpd.config.settings_file import Loaded, load_settings, load_with_sources
from hvcpd.config.task_changes import TaskChanges
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskRepository
from hvcpd.control.output import print_note
from hvcpd.errors import ConfigError, VocabularyError, did_you_mean
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.memory import PEOPLE_FOLDER
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.likeness import name_check, name_fault, sounds_alike

if TYPE_CHECKING:
    from hvcpd.people.enrolled import Person


@dataclass(frozen=True)
class Team:
    """A team's settings and tasks, the names in use, its phrasebook and its pronunciations."""

    settings: Settings
    tasks: TaskRepository
    names: tuple[str, ...]
    phrasebook: Phrasebook
    sound: Sound
    people: Mapping[str, Person]
    """The enrolled people among the names, by name in lower case."""


def vocabulary_cache() -> Path | None:
    """Where commands cache the results of the vocabulary check; None without a home folder."""
    units = user_cache_folder()
    return units.parent / "vocabulary" if units is not None else None


def load_team(
    options: argparse.Namespace,
    names: tuple[str, ...] = (),
    more: tuple[str, ...] = (),
    allow_confusable: bool = False,
    sealed: bool = False,
    encrypted: bool = False,
    changes: TaskChanges | None = None,
) -> Team:
    """The team that a command line and the settings describe; `names` replace, `more` join the settings' names.

    With `allow_confusable`, the names of tasks and robots may sound alike; a `sealed` team has a key, and an
    `encrypted` one hides what it says; `changes` of the tasks are one robot's. Raises ConfigError and PhraseError.
    """
    reserved = None if names else name_check
    given = {"tasks": options.tasks, "state_dir": getattr(options, "state_dir", None)}  # an option of enrol
    overrides = {key: path and str(path) for key, path in given.items()}
    settings = load_settings(options.config, overrides, name_needed=False, reserved=reserved)
    sound = make_sound(settings.lexicon, user_cache_folder(), settings.accent)
    alike = None if allow_confusable else partial(sounds_alike, lexicon=sound.lexicon)
    tasks = load_tasks(settings.tasks, alike, changes, len(names or settings.names))
    people = _enrolled(settings, names or settings.names, sound.lexicon, allow_confusable)
    enrolled = tuple(person.name for person in people.values())
    known = {name.lower(): name for name in (*(names or (*settings.names, *enrolled)), *more)}
    people = {key: person for key, person in people.items() if key in known}
    used = tuple(known.values())
    if not allow_confusable:
        refuse_same_sound(used, sound.lexicon)
    if faults := [fault for name in used if (fault := name_fault(name, sound.lexicon))]:
        raise ConfigError("\n".join(faults))
    security = settings.security
    has_key = sealed or security.key is not None
    encrypts = encrypted or (has_key and security.encrypted)
    try:
        phrasebook = make_phrasebook(used, settings.teams, tasks, has_key, encrypts)
    except VocabularyError as error:
        raise ConfigError(error.at(partial(place_of, settings.tasks))) from error
    sound = assign_voices(sound, settings, lambda: phrasebook.marked_graph.words)
    return Team(settings, tasks, used, phrasebook, sound, people)


def robots_of(options: argparse.Namespace) -> tuple[str, ...]:
    """The robots that the settings name, without enrolled people. Raises ConfigError."""
    return named_robots(load_with_sources(options.config, name_needed=False, reserved=name_check))


def named_robots(loaded: Loaded) -> tuple[str, ...]:
    """The robots that these settings name, without enrolled people."""
    people = _enrolled(loaded.settings, loaded.settings.names, Lexicon.load())
    named = {name.lower(): name for name in (*loaded.settings.names, loaded.name) if name is not None}
    return tuple(name for key, name in named.items() if key not in people)


def as_written(robot: str, robots: Iterable[str]) -> str | None:
    """The one of these robots that has the name, as it is written among them; None if there is none."""
    return next((name for name in robots if name.lower() == robot.lower()), None)


def taking_part(robot: str, robots: Iterable[str], option: str) -> str:
    """The robot that an option names, as it is written. Raises ConfigError for one that does not take part."""
    if (name := as_written(robot, robots)) is None:
        raise ConfigError(f"{option}: {robot} does not take part; {did_you_mean(robot, robots)}")
    return name


def unable_robots(team: Team, robots: Iterable[str]) -> dict[str, frozenset[int]]:
    """By the name of the settings' robot, if it takes part, the numbers of the tasks that it cannot do."""
    own = as_written(team.settings.name, robots)
    return {own: team.settings.unable_for(team.tasks)} if own is not None else {}


def lacked_skills(
    without: Iterable[tuple[str, str]], robots: Sequence[str], skills: Collection[str], team: Team
) -> dict[str, frozenset[str]]:
    """By the names of `robots`, which of the `skills` each lacks. Warns of tasks for which too few robots remain.

    Raises ConfigError for another robot or skill.
    """
    unable = unable_robots(team, robots)
    lacked: dict[str, frozenset[str]] = {}
    for robot, skill in without:
        name = taking_part(robot, robots, "--without")
        if skill not in skills:
            remedy = did_you_mean(skill, skills) if skills else "declare it under `skills:` in the task file"
            raise ConfigError(f"--without: {name} has no skill {skill!r}; {remedy}")
        lacked[name] = lacked.get(name, frozenset()) | {skill}
    for task in team.tasks.tasks:
        willing = [name for name in robots if task.number not in unable.get(name, ())]
        able = sum(task.skills.isdisjoint(lacked.get(name, ())) for name in willing)
        if able < task.robots:
            remain = f"{able or 'no'} robot{'s' * (able > 1)}" + f" of {task.robots}" * (task.robots > 1)
            why = "--without leaves" if len(willing) > able else f"what {team.settings.name} cannot do leaves"
            print_note(f"warning: task {task.number}, {task.name!r}: {why} {remain} to do it")
    return lacked


def _enrolled(
    settings: Settings, robots: Iterable[str], lexicon: Lexicon, allow_same: bool = False
) -> dict[str, Person]:
    """People whose voices are known, by name in lower case; nobody for a user who may not look, as most of a robot's
    computer are. What is wrong with an enrolment is told on standard error."""
    if settings.voices == "robots" or not os.access(settings.state_dir / PEOPLE_FOLDER, os.R_OK):
        return {}
    from hvcpd.memory.people import tellable_people  # not for those who have enrolled nobody: it loads the ears

    people, faults = tellable_people(settings.state_dir, robots, lexicon, allow_same)
    for fault in faults:
        print_note(f"warning: {fault}")
    return people


def refuse_confusable(team: Team, allowable: bool = True) -> None:
    """Raises ConfigError if words that the team chose are confused with others. `allowable`: as for `refusal`."""
    from hvcpd.assembly.vocabulary import check, refusal  # loads the recogniser

    found = check(team.phrasebook, team.names, team.sound, vocabulary_cache(), chosen_only=True)
    if why := refusal(found, team.settings.tasks, allowable):
        raise ConfigError(why)


def refuse_same_sound(names: Sequence[str], lexicon: Lexicon) -> None:
    """Raises ConfigError if names are pronounced alike, with all such pairs."""
    said = {name: set(lexicon.sounds(name)) for name in names}
    pairs = [(first, second) for first, second in combinations(names, 2) if said[first] & said[second]]
    if pairs:
        faults = (f"the names {a!r} and {b!r} sound the same; choose another for one of them" for a, b in pairs)
        raise ConfigError("\n".join(faults))
