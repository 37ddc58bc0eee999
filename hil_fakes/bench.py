"""The bench: whole robots in one simulated room, in virtual time, as fast as the processor can.

Each robot has its own store, its own random generator, its own sample clock that starts when it is switched on, its
own motors on its own pty. Between the robots there is nothing but the room's sound.
"""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace

import numpy as np

from hil_fakes.body import Body
from hil_fakes.furnished_room import FurnishedRoom
from hil_fakes.haste import Haste
from hil_fakes.loudspeakers import USUAL, Loudspeaker
from hil_fakes.room import Air, Noise, Point, Room, Ways
from hil_fakes.scorekeeper import Scorekeeper
from hil_fakes.skills import FakeDevice, FakeHost
from hvcpd.assembly.make import make_robot
from hvcpd.assembly.name_registry import NameRegistry
from hvcpd.assembly.plan import BodyPlan, HearingPlan, RobotPlan, SecurityPlan, TeamPlan
from hvcpd.assembly.sound import Sound
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import Role, Speech, Talk, Timing
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.entry import Entry
from hvcpd.coordination.states import State
from hvcpd.errors import PhraseError
from hvcpd.memory.journal import Journal
from hvcpd.memory.store import Store
from hvcpd.memory.store_file import IN_MEMORY
from hvcpd.ports import SAMPLE_RATE_HZ, STANDSTILL, Pose, Samples, WheelCommand, WheelReading
from hvcpd.recognition.stages import SynchronousWorker
from hvcpd.reporting.events import Event, MissionRecord, Moved, Plant, Started, Switched, Trail
from hvcpd.reporting.text import plural
from hvcpd.robot.records import LearnName
from hvcpd.robot.robot import Robot
from hvcpd.security.keys import KeyRing

BLOCK = 400
"""Samples a step, 25 ms: a robot reacts one block after a sound."""
BLOCK_S = BLOCK / SAMPLE_RATE_HZ
MOVING_BLOCKS = 2
"""A moving robot's wheels are served every 50 ms, as ROBOTIS's own node does."""
STANDING_BLOCKS = 8
"""A standing robot's every 200 ms: within the motors' bus watchdog of 0.24 s."""
MAP_BLOCKS = 40
"""The live view learns the robots' places once a second."""
SWITCH_ON_SPREAD_S = 1.5
"""Robots are switched on by hand, one after the other."""
SETTLE_S = 2.0
"""Time for which sound goes on after the last task is known to be done."""
START_SPACING_M = 1.0
START_CORNER = (-5.0, -5.0)
"""The paper's robots start at (−5, −5)."""
ROW = 4


@dataclass(frozen=True)
class BenchPlan:
    """One mission. In coordinate mode `coordinator` gives the orders; in volunteer mode it is None."""

    names: tuple[str, ...]
    tasks: TaskRepository
    seed: int = 0
    coordinator: str | None = None
    team: str = "plant"
    nearest_first: bool = False
    air: Air = field(default_factory=Air)
    ways: Ways = field(default_factory=FurnishedRoom)
    """Ways of sound between two robots."""
    loudspeaker: Loudspeaker = USUAL
    """The model of all robots' loudspeakers."""
    noise_at: Callable[[int], Noise] | None = None
    """Makes the sound at each robot's microphone in quiet; None: pink noise, as loud as in `air`."""
    hasty: bool = False
    """Whether a robot that claims a task drives off at once, as the paper's robots do; ours stand still until they are
    heard."""
    strangers: bool = False
    """Each robot knows only its own name in advance."""
    speech: Speech = field(default_factory=Speech)
    """The delivery of all robots' sentences."""
    talk: Talk = Talk.NORMAL
    """How much all robots say."""
    keys: KeyRing | None = None
    """The team's keys; None: no sentence is sealed."""
    encrypts: bool = False
    """Whether robots with a key also encrypt their statements."""
    starts: tuple[Pose, ...] | None = None
    """Places where the robots start; None: in rows, a metre apart."""
    met_s: float = 0.0
    """Until then they hear each other as if they stood in rows a metre apart: robots that have met know each other."""
    timing: Timing | None = None
    """Times for which robots wait for each other; None: the usual ones."""
    earshot_m: float = math.inf
    """Distance beyond which robots hear nothing of each other, whatever the air."""
    earshot_from_s: float = 0.0
    """Time from which on `earshot_m` holds, so that robots can meet before."""
    unable: Mapping[str, frozenset[int]] = field(default_factory=dict)
    """The numbers of the tasks that each robot cannot do."""
    skills: Mapping[str, Mapping[str, FakeDevice]] = field(default_factory=dict)
    """The device of each robot's skills."""
    limit_s: float = 1800.0
    """The mission is given up after this."""


def own_seed(seed: int, name: str) -> int:
    """A robot's own seed: unrelated to any other's, the same on every machine."""
    return int.from_bytes(hashlib.sha256(f"{seed}/{name.lower()}".encode()).digest()[:6], "big")


def start_poses(n: int) -> tuple[Pose, ...]:
    """Rows of robots a metre apart, from the paper's corner of the room."""
    x_m, y_m = START_CORNER
    return tuple(Pose(x_m + START_SPACING_M * (k % ROW), y_m + START_SPACING_M * (k // ROW)) for k in range(n))


@dataclass
class _Place:
    """One robot on the bench, and its state that the others cannot see."""

    name: str
    robot: Robot
    body: Body
    journal: Journal
    off_blocks: int
    roster: NameRegistry
    haste: Haste | None = None
    host: FakeHost = field(default_factory=FakeHost)
    playing: Samples = field(default_factory=lambda: np.zeros(BLOCK, np.float32))
    wheels: WheelCommand = STANDSTILL
    served_block: int = -(10**6)
    recording: list[Samples] = field(default_factory=list)
    records: tuple[object, ...] = ()

    def serve_wheels(self, block: int) -> WheelReading | None:
        """Exchange with the motors when it is time; None in between."""
        every = STANDING_BLOCKS if self.wheels == STANDSTILL else MOVING_BLOCKS
        if block - self.served_block < every:
            return None
        self.served_block = block
        return self.body.exchange(self.wheels)

    def live(self, block: int, heard: Samples) -> None:
        """Let one block, shape (n,), float32, of this robot's life pass."""
        self.recording.append(heard)
        if block < self.off_blocks:
            return
        reading = self.serve_wheels(block)
        self.host.live(self.robot.now, self.robot.performer.tell)
        output = self.robot.step(heard, reading)
        self.host.take(output.skills, self.robot.now)
        self.playing = output.sound
        wheels = output.wheels
        if self.haste is not None:
            wheels = self.haste.wheels(output, self.robot.odometry.pose, self.robot.now, reading)
        if wheels == STANDSTILL and self.wheels != STANDSTILL:
            self.served_block = -(10**6)  # a halt goes out with the next block
        self.wheels = wheels
        self.records = output.records
        self.journal.write(output.records, self.robot.now)
        for record in output.records:
            if isinstance(record, LearnName):
                with suppress(PhraseError):  # a name that cannot be told from a known one stays unknown
                    self.robot.adopt(*self.roster.learn(record.name))

    @property
    def on_s(self) -> float:
        """When it was switched on, by the bench's clock."""
        return self.off_blocks * BLOCK_S


class Bench:
    """Runs one mission. `sink` gets every event as it happens; `pace` is called after every block with the time
    and the listener's sound (to play it, or to slow down to real time)."""

    def __init__(
        self,
        plan: BenchPlan,
        sound: Sound,
        sink: Callable[[Event], None] = lambda _event: None,
        pace: Callable[[float, Samples], None] = lambda _now, _sound: None,
    ) -> None:
        self.plan = plan
        self._sound = sound
        self._sink = sink
        self._pace = pace
        self.recordings: dict[str, Samples] = {}
        """The recording of each robot's microphone from the mission's beginning, by name."""
        self.robots: dict[str, Robot] = {}

    def run(self) -> MissionRecord:
        """Run the mission to its end. Raises any exception of a robot: there is no fault from outside on this bench."""
        began_s = time.perf_counter()
        starts = self.plan.starts or start_poses(len(self.plan.names))
        plants = tuple(
            Plant(t.number, t.name, t.place.x_m, t.place.y_m)
            for t in self.plan.tasks.tasks
            if t.place is not None and t.place in t.places
        )
        names = tuple((t.number, t.name) for t in self.plan.tasks.tasks)
        icons = tuple((t.number, t.icon) for t in self.plan.tasks.tasks if t.icon)
        shared = tuple((t.number, t.robots) for t in self.plan.tasks.tasks if t.robots > 1)
        mode = "volunteer" if self.plan.coordinator is None else "coordinate"
        score = Scorekeeper(self.plan.names, self.plan.tasks, self._sink)
        on_demand = tuple(t.number for t in self.plan.tasks.tasks if t.on_demand)
        noise_db_spl = self.plan.air.noise_db_spl
        head = (0.0, self.plan.names, starts, plants, mode, self.plan.seed, noise_db_spl)
        score.emit(Started(*head, names, icons, shared, on_demand, self.plan.tasks.places))
        with ExitStack() as stack:
            places = [self._make_place(k, start, stack) for k, start in enumerate(starts)]
            self.robots = {place.name: place.robot for place in places}
            listener, trails, virtual_s = self._live(places, score)
        self.recordings = {place.name: np.concatenate(place.recording) for place in places}
        wall_s = time.perf_counter() - began_s
        stopped = tuple(name for name, robot in self.robots.items() if robot.coordination.state is State.STOPPED)
        summary = replace(score.summary(virtual_s, wall_s, self.plan.seed, mode), stopped=stopped)
        score.emit(summary)
        title = f"{plural(len(self.plan.names), 'robot')} share out {plural(summary.tasks, 'task')}"
        return MissionRecord(tuple(score.events), trails, listener, title=title)

    def _make_place(self, k: int, start: Pose, stack: ExitStack) -> _Place:
        plan, name = self.plan, self.plan.names[k]
        rng = np.random.default_rng(own_seed(plan.seed, f"switch {name}"))
        skills = plan.skills.get(name, {})
        role = Role(
            name,
            plan.team,
            coordinator=name == plan.coordinator,
            volunteer=plan.coordinator is None,
            nearest_first=plan.nearest_first,
            unable=plan.unable.get(name, frozenset()) | plan.tasks.lacking(skills),
            listed=not plan.strangers,
            speech=plan.speech,
            talk=plan.talk,
        )
        names = (name,) if plan.strangers else plan.names
        robot_plan = RobotPlan(
            role,
            TeamPlan(names, strangers=plan.strangers),
            plan.tasks,
            own_seed(plan.seed, name),
            BodyPlan(start),
            hearing=HearingPlan(channel=SynchronousWorker()),
            security=SecurityPlan(plan.keys, plan.encrypts),
            timing=plan.timing,
        )
        store = Store(IN_MEMORY)
        stack.callback(store.close)
        body = stack.enter_context(Body(start, own_seed(plan.seed, f"body {name}")))
        off_blocks = round(rng.random() * SWITCH_ON_SPREAD_S / BLOCK_S)
        robot, roster = make_robot(robot_plan, self._sound), NameRegistry(robot_plan, self._sound)
        robot.performer.offer(frozenset(skills))
        haste = Haste(plan.tasks) if plan.hasty else None
        host = FakeHost(skills)
        return _Place(name, robot, body, Journal(store, plan.tasks, name), off_blocks, roster, haste, host)

    def _live(self, places: list[_Place], score: Scorekeeper) -> tuple[Samples, tuple[Trail, ...], float]:
        plan = self.plan
        noises = None if plan.noise_at is None else [plan.noise_at(k) for k in range(len(places))]
        room = Room(len(places), plan.air, plan.seed, _middle(plan.tasks), plan.ways, noises, plan.loudspeaker)
        heard_by_listener: list[Samples] = []
        path: list[list[Pose]] = []
        block = 0
        for block in self._blocks(places):
            now = (block + 1) * BLOCK_S
            room.earshot_m = self.plan.earshot_m if now >= self.plan.earshot_from_s else math.inf
            poses = [p.body.pose for p in places] if now >= self.plan.met_s else start_poses(len(places))
            taken = room.advance([p.playing for p in places], [(pose.x_m, pose.y_m) for pose in poses])
            heard_by_listener.append(taken[-1])
            for place, heard in zip(places, taken, strict=False):
                place.records = ()
                place.live(block, heard)
                place.body.advance(BLOCK_S)
                score.note(place.name, place.on_s, place.records, place.body.pose, now)
                for each in place.host.take_switches():
                    score.emit(Switched(place.on_s + each.at_s, place.name, each.task, each.skill, each.on))
            path.append([place.body.pose for place in places])
            if block % MAP_BLOCKS == 0:
                score.emit(Moved(now, tuple(path[-1])))
            self._pace(now, taken[-1])
        times_s = np.arange(1, len(path) + 1, dtype=np.float64) * BLOCK_S
        trails = tuple(
            Trail(p.name, times_s, np.array([row[k].x_m for row in path]), np.array([row[k].y_m for row in path]))
            for k, p in enumerate(places)
        )
        return np.concatenate(heard_by_listener), trails, (block + 1) * BLOCK_S

    def _blocks(self, places: list[_Place]) -> Iterator[int]:
        """Block numbers until no robot has anything left to do and silence has settled, or the limit."""
        block, settled = 0, 0
        while block * BLOCK_S < self.plan.limit_s and settled * BLOCK_S < SETTLE_S:
            yield block
            block += 1
            quiet = all(_is_through(p.robot.coordination) and not p.robot.speaking for p in places)
            settled = settled + 1 if quiet else 0


def _is_through(c: Coordination) -> bool:
    """Whether the robot knows that all is done, is free and can do none of the remaining tasks, or is stopped and has
    said how to release it: nobody here says "resume"."""
    if c.board.all_done:
        return True
    if c.state is State.STOPPED:
        return not c.knowledge.floor.wants("released how")
    left = (entry for entry in c.board.entries() if not entry.known_done)
    return c.state is State.READY and c.role.volunteer and not any(_can_do(c, entry) for entry in left)


def _can_do(c: Coordination, entry: Entry) -> bool:
    """Whether the robot can do a task, alone or with others who have not given it up; what must come first is another
    task that is left."""
    task, names = entry.definition, {c.role.name, *c.role.roster}
    able = c.role.name not in entry.failed_by and task.number not in c.role.unable
    enough = not c.role.roster or len(names - entry.failed_by) >= task.robots  # strangers may be many
    return able and enough and c.board.can_begin(entry)


def _middle(tasks: TaskRepository) -> Point:
    """The listener's place: between the plants and the robots' start."""
    points = [START_CORNER, *((t.place.x_m, t.place.y_m) for t in tasks.tasks if t.place is not None)]
    return sum(p[0] for p in points) / len(points), sum(p[1] for p in points) / len(points)
