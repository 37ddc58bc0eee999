"""Everything that a robot needs besides its devices, from its settings."""

from __future__ import annotations

import secrets
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

import structlog

from hvcpd.assembly.plan import BodyPlan, HearingPlan, MemoryPlan, RobotPlan, SecurityPlan, TeamPlan, speech_of
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound
from hvcpd.assembly.voice_assignment import assign_voices
from hvcpd.config.document import place_of
from hvcpd.config.names import MAX_NAME_LENGTH, valid_robot_name
from hvcpd.config.quiet_hours import CLOCK_SET_S
from hvcpd.config.settings import MAX_KNOWN_NAMES, Settings
from hvcpd.config.task_changes import TaskChanges, read_changes
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import Role, Talk, Timing
from hvcpd.daemon.pose_keeper import KeptPose
from hvcpd.errors import ConfigError, HvcpdError, KeyFileError, PhraseError, VocabularyError
from hvcpd.hardware.kinematics import Drive, drive_of
from hvcpd.hardware.navigator import Navigator
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.memory.people import tellable_people
from hvcpd.people.enrolled import Person
from hvcpd.people.second_pass import Found
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from hvcpd.recognition.stages import Segment, Worker
from hvcpd.robot.own_voice import Acoustics
from hvcpd.security.keyring import KeyFile, find_key_file, keep_out_of_dumps, read_key_file
from hvcpd.security.keys import KeyRing
from hvcpd.security.trust import People
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.likeness import sounds_alike

_log = structlog.get_logger(__name__)

SEED_BITS = 32
"""Of a fresh seed; as many as the settings' `seed` may have."""


ONE_DAY = timedelta(days=1)
"""Between the days of two places on Earth."""


@dataclass(frozen=True)
class Wiring:
    """Checked settings with all files that they name. `people`: those enrolled, robots excluded, by lower-case name;
    `unknown`: what is wrong with the enrolments that cannot be used; `damage`: why the tasks that commands added or
    removed cannot be read, None if they can."""

    settings: Settings
    tasks: TaskRepository
    sound: Sound
    keys: KeyFile | None = None
    people: Mapping[str, Person] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()
    damage: str | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """All robots and people known in advance, this robot first."""
        own = self.settings.name
        people = (person.name for person in self.people.values())
        others = {name.casefold(): name for name in (*people, *self.settings.names)}
        return own, *(name for key, name in others.items() if key != own.casefold())

    @property
    def seals_path(self) -> Path:
        """The file of the counters of seals, apart from the tasks; see `Journal`."""
        return self.settings.state_dir / f"{self.settings.name.lower()}.seals.sqlite3"

    @property
    def latch_path(self) -> Path:
        """The file of the stop latch; see `StopLatch`."""
        return self.settings.state_dir / f"{self.settings.name.lower()}.latch"

    @property
    def unable(self) -> frozenset[int]:
        """The tasks that the robot cannot do."""
        return self.settings.unable_for(self.tasks)

    @property
    def drive(self) -> Drive:
        """The robot's dimensions."""
        return drive_of(self.settings.wheels)

    def with_talk(self, role: Role, wall_s: float) -> Role:
        """The role with the `talk` and level that the settings prescribe for this time, s since 1970."""
        settings = self.settings
        is_quiet = settings.clock and settings.quiet.holds_at(wall_s)
        talk = Talk.TERSE if is_quiet else Talk(settings.talk)
        softly_db = settings.quiet.level_db if is_quiet else 0.0
        unchanged = (role.talk, role.softly_db) == (talk, softly_db)
        return role if unchanged else replace(role, talk=talk, softly_db=softly_db)

    def known_s(self, wall_s: float) -> float | None:
        """The time `wall_s` of the computer's clock, s since 1970; None if that is wrong by the settings, or was never
        set: what is done would be due again once it is."""
        return wall_s if self.settings.clock and wall_s >= CLOCK_SET_S else None

    def with_live(self, role: Role) -> Role:
        """The role with the settings that may change while the robot runs."""
        settings, role = self.settings, self.with_talk(role, time.time())
        return replace(
            role,
            coordinator=settings.mode == "coordinate",
            volunteer=settings.mode == "volunteer",
            nearest_first=settings.pick == "nearest",
            unable=self.unable,
        )

    def wall_s(self) -> float | None:
        """The time, seconds since 1970; None without a key, or if the clock is set to before the newest
        key was made, so not at all."""
        if self.keys is None:
            return None
        now_s = time.time()
        return now_s if datetime.fromtimestamp(now_s, UTC).date() >= self.keys.newest - ONE_DAY else None

    def ring(self) -> KeyRing | None:
        """The keys that are valid today, if the team has any."""
        wall_s = self.wall_s()
        today = datetime.fromtimestamp(wall_s, UTC).date() if wall_s is not None else None
        return self.keys.ring(today) if self.keys is not None else None

    def ring_now(self) -> KeyRing | None:
        """As `ring`; None if every key has expired meanwhile: the last ones then hold until the robot is restarted."""
        with suppress(KeyFileError):
            return self.ring()
        return None

    def _phrasebook(self, names: Sequence[str]) -> Phrasebook:
        settings = self.settings
        return make_phrasebook(names, settings.teams, self.tasks, self.keys is not None, settings.security.encrypted)

    def phrasebook(self) -> Phrasebook:
        """The phrasebook of the known names. Raises PhraseError."""
        return self._phrasebook(self.names)

    def names_with(self, heard: Sequence[str]) -> tuple[str, ...]:
        """The given names and, as far as there is room, those `heard` last that do not sound like them."""
        names = self.names
        for name in reversed(heard):
            if len(names) >= MAX_KNOWN_NAMES or any(name.casefold() == known.casefold() for known in names):
                continue
            try:
                if (wrong := valid_robot_name(name)) is not None:  # a failing card has changed it
                    raise PhraseError(wrong)
                self._phrasebook((*names, name))
            except PhraseError as error:
                _log.warning("name forgotten", name=name[:MAX_NAME_LENGTH], reason=str(error))
            else:
                names = (*names, name)
        return names

    def plan(
        self,
        memory: MemoryPlan | None = None,
        latency_s: float = 0.0,
        heard: Sequence[str] = (),
        here: KeptPose | None = None,
        navigator: Navigator | None = None,
        channel: Worker[ChannelSegment, SearchResult] | None = None,
        second: Worker[Segment, Found] | None = None,
        people: Mapping[str, Person] | None = None,
    ) -> RobotPlan:
        """What makes this robot, with what it remembers, and the names that it `heard`.

        `latency_s` is its sound's. `here` is where it stands, if that is not where the settings have it start.
        `navigator` finds its ways; None: the usual one. `channel` looks again for robots through a channel that is not
        known, `second` at what no robot's voice explains. `people`, looked up anew each time, are those who are
        enrolled by then; None: those of now.

        Without a seed in the settings it gets a fresh one.
        """
        settings, start, waits = self.settings, self.settings.start.pose, self.settings.waits
        names = self.names_with(heard)
        role = Role(
            settings.name,
            settings.team,
            speech=speech_of(settings.speech),
            listed=any(name.casefold() == settings.name.casefold() for name in settings.names),
            people=People(settings.security.people),
        )
        return RobotPlan(
            self.with_live(role),
            TeamPlan(names, self.names, settings.teams, strangers=True),
            self.tasks,
            settings.seed if settings.seed is not None else secrets.randbits(SEED_BITS),
            BodyPlan(
                here.pose if here is not None else start,
                start,
                here.reading if here is not None else None,
                self.drive,
                navigator,
            ),
            (memory or MemoryPlan()).with_names(names),
            HearingPlan(
                Acoustics(latency_s),
                self.people if people is None else people,
                channel,
                second if settings.voices != "robots" else None,
                any_voice=settings.voices == "any",
                prepared=False,
            ),
            SecurityPlan(self.ring(), settings.security.encrypted),
            Timing(absent_s=waits.absent_s, lease_s=waits.lease_s, answer_s=waits.answer_s),
        )


def wire_up(settings: Settings, allow_confusable: bool = False, changes: TaskChanges | None = None) -> Wiring:
    """Read the lexicon, the tasks and the team's key, and try the phrasebook. Raises ConfigError with the faults of all
    four, or else with those of recorded voices.

    With `allow_confusable`, task names may sound alike. `changes` of the tasks take the place of those that are kept.
    Where these cannot be read, the wiring is without them, and says so: a robot far from its user is to start.
    """
    faults: list[str] = []
    damage = None
    if changes is None:
        try:
            changes = read_changes(settings.task_changes_path)
        except ConfigError as error:
            changes, damage = TaskChanges(), "; ".join(str(error).splitlines())
    sound = tasks = keys = None
    try:
        keys = _team_key(settings)
    except HvcpdError as error:
        faults.append(str(error))
    try:
        sound = make_sound(settings.lexicon, settings.state_dir / "units", settings.accent)
    except HvcpdError as error:
        faults.append(str(error))
    lexicon = sound.lexicon if sound is not None else Lexicon.load()
    people, unknown = _people(settings, lexicon, allow_confusable)
    try:
        alike = None if allow_confusable else partial(sounds_alike, lexicon=lexicon)
        robots = {name.casefold() for name in (settings.name, *settings.names)} - people.keys()
        tasks = load_tasks(settings.tasks, alike, changes, len(robots))
    except HvcpdError as error:
        faults.append(str(error))
    if sound is None or tasks is None or faults:
        raise ConfigError("\n".join(faults))
    for every in filter(None, (task.every for task in tasks.tasks)):
        every.last(time.time())  # an hourly rule has too many times for a robot at work to seek them
    numbers = [task.number for task in tasks.tasks]
    for number in settings.unable:
        if number not in numbers and damage is None:
            listed = ", ".join(map(str, numbers))
            raise ConfigError(f"unable: {settings.tasks} has no task {number}; its numbers are {listed}")
    wiring = Wiring(settings, tasks, sound, keys, people, unknown, damage)
    try:
        phrasebook = wiring.phrasebook()
    except VocabularyError as error:
        raise ConfigError(error.at(partial(_place_of_words, settings.tasks, changes))) from error
    return replace(wiring, sound=assign_voices(sound, settings, lambda: phrasebook.marked_graph.words))


def _place_of_words(file: Path, changes: TaskChanges, written: str) -> str:
    """The place of a task's words: in an added task, or in the task file."""
    added = (place for document, _ in changes.added for text, place in document.texts() if text == written)
    return str(next(added, None) or place_of(file, written))


def _people(settings: Settings, lexicon: Lexicon, allow_same: bool) -> tuple[dict[str, Person], tuple[str, ...]]:
    """The enrolled people, and the faults of files that cannot be used."""
    if settings.voices == "robots":
        return {}, ()
    robots = (settings.name, *settings.names)
    people, faults = tellable_people(settings.state_dir, robots, lexicon, allow_same)
    return {name: person for name, person in people.items() if name != settings.name.lower()}, faults


def _team_key(settings: Settings) -> KeyFile | None:
    """The team's keys, if there are any; from then on no other process can read this one's memory."""
    path = find_key_file(settings.security.key)
    if path is None:
        if settings.security.encrypted:
            raise ConfigError("security.encrypted: there is no key to encrypt with; make one with: hvcpctl key new")
        return None
    keep_out_of_dumps()
    return read_key_file(path)
