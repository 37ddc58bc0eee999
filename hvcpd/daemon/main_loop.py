"""A robot's life: the start order, one loop, and the same order backward at the end."""

from __future__ import annotations

import asyncio
import math
import time
from contextlib import AsyncExitStack, suppress
from functools import partial
from typing import TYPE_CHECKING

import structlog

from hvcpd.assembly.make import make_robot
from hvcpd.assembly.name_registry import NameRegistry
from hvcpd.assembly.plan import MemoryPlan, RobotPlan
from hvcpd.daemon.adaptation import Adaptation, CurrentPeople
from hvcpd.daemon.allocator import give_back_memory
from hvcpd.daemon.base_request_handler import BaseRequestHandler
from hvcpd.daemon.cache_warm_up import CacheWarmUp, Preparation
from hvcpd.daemon.clips import Clips
from hvcpd.daemon.control_service import ControlService
from hvcpd.daemon.control_socket import runtime_file
from hvcpd.daemon.control_status import Body
from hvcpd.daemon.devices import Devices
from hvcpd.daemon.journal_service import JournalService
from hvcpd.daemon.logging import log_record
from hvcpd.daemon.name_learning import NameLearning, Rendered, at_once
from hvcpd.daemon.notify import ServiceManager
from hvcpd.daemon.pose_keeper import KeptPose, PoseKeeper
from hvcpd.daemon.reloading import Rereading
from hvcpd.daemon.second_pass import SecondPass, one_thread
from hvcpd.daemon.sound_service import TOO_BUSY, SoundService
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.daemon.wiring import Wiring
from hvcpd.errors import HvcpdError
from hvcpd.hardware.goals import GoalNavigator
from hvcpd.hardware.ros_base import RosBase
from hvcpd.people.second_pass import Found
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from hvcpd.recognition.stages import Segment
from hvcpd.robot.robot import Robot

if TYPE_CHECKING:
    from hvcpd.daemon.skill_hosting import JointService

FAREWELL_S = 12.0
"""Longest time (sample clock) that a robot that is told to end waits for its turn to say so: another one's sentence of
5 s, a report that is still due, its own farewell."""
FAREWELL_WALL_S = 20.0
"""Longest time by the wall clock for the farewell, should sound have stopped coming; within the unit's
TimeoutStopSec."""

BUTTON_S = 0.025
"""Interval (real time) at which the stop button is read while the robot starts: as often as later, in each block."""

STOPPED = 'stopped until somebody says "resume"'
DEAF = "deaf: the microphone is mute, and the robot stands still until it hears"
NO_SOUND = "without sound: the robot stands still, and tries again to open the sound card"

_log = structlog.get_logger(__name__)


class Daemon:
    """One robot on its devices. `run` ends by `leave`, cancellation or an error; the wheels then stand still."""

    def __init__(
        self,
        wiring: Wiring,
        devices: Devices,
        manager: ServiceManager | None = None,
        rereading: Rereading | None = None,
        rendered: Rendered = at_once,
    ) -> None:
        """`rendered` waits until another process has rendered the words that the robot does not need at once."""
        self._listens = f"{wiring.settings.name} of team {wiring.settings.team} listens"
        self._manager = manager or ServiceManager({})
        self._devices = devices
        self._rendered = rendered
        self._pose = PoseKeeper(runtime_file(wiring.settings, ".pose"))
        self._body = Body(wiring, JournalService(wiring))
        self._control = ControlService(self._body, rereading)
        self._clips = Clips(lambda: self._body.wiring.settings.clips, wiring.settings.name)
        self._name_learning: NameLearning | None = None
        self._adaptation: Adaptation | None = None
        self._channel = SecondPass[ChannelSegment, SearchResult](SearchResult(), partial(one_thread, "channel-search"))
        self._second = SecondPass[Segment, Found](None)
        self._body.preparation = Preparation(self._tell_preparation)
        self.listening = False
        """Whether the robot listens and speaks, so that it can say that it leaves."""
        self._ready = asyncio.Event()
        """Set once all is there that a reload changes."""
        self._held_down = False
        """Whether the stop button was pressed when it was last looked at."""
        self._leave_until_s: float | None = None

    @property
    def wiring(self) -> Wiring:
        """The wiring in force; a reload replaces it."""
        return self._body.wiring

    @property
    def robot(self) -> Robot | None:
        """None as long as it is being made."""
        return self._body.robot

    @property
    def sound(self) -> SoundService | None:
        """None as long as the card is not looked for."""
        return self._body.sound

    def leave(self) -> None:
        """Make `run` return once the robot has said that it leaves, after FAREWELL_S at the latest."""
        if self.robot is not None and self._leave_until_s is None:
            self._leave_until_s = self.robot.now + FAREWELL_S
            self._manager.stopping("saying goodbye")
            self.robot.coordination.leave(self.robot.now)

    async def reload(self) -> None:
        """Read the settings and tasks again, as soon as the robot is ready; errors are logged, and change nothing."""
        await self._ready.wait()
        with suppress(HvcpdError):
            await self._control.reloader.reload()

    async def run(self) -> None:
        """Start everything in order, live, and take it down in reverse order.

        Raises StoreError, DeviceError, ConfigError, and RunningError if a robot of this name runs here already.
        """
        body, settings = self._body, self.wiring.settings
        async with AsyncExitStack() as stack:
            stack.callback(self._manager.close)
            stack.callback(self._control.release)
            stack.push_async_callback(body.journal.close)
            stack.push_async_callback(self._clips.close)
            stack.push_async_callback(self._channel.close)
            stack.push_async_callback(self._second.close)
            stack.push_async_callback(self._pose.close)
            stack.push_async_callback(self._control.close)
            stack.callback(body.preparation.stop)
            await self._control.open()
            self._open_button(stack)
            memory = await body.journal.open()
            here = self._pose.recall()
            self._tell_start(memory, here)

            sound = body.sound = SoundService(lambda: self._devices.make_stream(settings.audio))
            stack.push_async_callback(sound.close)
            await sound.open()

            self._manager.status("preparing words; the first time takes longest")
            navigator = self._goal_navigator()
            enrolled = CurrentPeople(lambda: body.wiring.people)
            heard, workers = body.journal.names, (self._channel, self._second)
            plan = self.wiring.plan(memory, sound.latency_s, heard, here, navigator, *workers, enrolled)
            warm_up = await self._warm_up(plan)
            robot = await asyncio.to_thread(make_robot, plan, self.wiring.sound)
            self._control.begin(robot)
            give_back_memory()
            registry = NameRegistry(plan, self.wiring.sound, settings.names)
            learning = self._name_learning = NameLearning(robot, registry, warm_up, self._rendered)
            stack.push_async_callback(learning.close)
            body.join, body.retask = learning.join, learning.retask
            self._ready.set()
            if settings.learn_voices:
                self._adaptation = Adaptation(
                    settings.name, enrolled, body.update_person, settings.state_dir, self._second, body.journal.robots
                )
                stack.push_async_callback(self._adaptation.settled)

            await self._find_wheels(stack, navigator)
            await sound.start()
            self._manager.ready(self._listens)
            learning.prepare()
            _log.info("listening", names=", ".join(plan.team.names), latency_s=round(sound.latency_s, 3))
            stack.callback(sound.tell_losses)
            with self._pose.forgotten_at_the_end():
                await self._live(robot, sound, learning)

    async def _warm_up(self, plan: RobotPlan) -> CacheWarmUp:
        """With the words rendered that the robot listens for."""
        warm_up = CacheWarmUp(plan, self.wiring.sound, self._body.preparation)
        await asyncio.to_thread(warm_up.before_listening)
        warm_up.tell_unkept()
        return warm_up

    def _open_button(self, stack: AsyncExitStack) -> None:
        button = self._body.button = self._devices.make_stop_button(self.wiring.settings.stop_button)
        if button is not None:
            stack.callback(button.close)
            watching = asyncio.ensure_future(self._watch_button())
            stack.callback(watching.cancel)

    async def _watch_button(self) -> None:
        """Until the robot lives, and looks at it in each block; it begins stopped if the button was pressed before."""
        while not self.listening:
            if self._look_at_button():
                self._control.handler.halt()
            await asyncio.sleep(BUTTON_S)

    def _look_at_button(self) -> bool:
        """Note whether the button is pressed. Returns whether it was not before."""
        before, self._held_down = self._held_down, self._body.is_held_down
        is_new = self._held_down and not before
        if is_new:
            _log.warning("stop button pressed")
        return is_new

    def _tell_preparation(self, text: str) -> None:
        if not self.listening:
            self._manager.status(text)

    def _goal_navigator(self) -> GoalNavigator | None:
        wheels = self.wiring.settings.wheels
        is_wanted = wheels.driver == "ros" and wheels.ros_mode == "goal"
        return GoalNavigator(self.wiring.drive) if is_wanted else None

    async def _find_wheels(self, stack: AsyncExitStack, navigator: GoalNavigator | None) -> None:
        joints = self._joints()
        wheels = self._devices.make_wheels(self.wiring.settings.wheels, joints.joints if joints is not None else ())
        if wheels is None:
            return
        self._manager.status("looking for the wheels")
        body = self._body
        if isinstance(wheels, RosBase):  # it comes and goes, and the robot talks on without it
            body.base = BaseRequestHandler(wheels, navigator)
            service = WheelService(wheels, lost_s=math.inf)
        else:
            service = WheelService(wheels)
        if joints is not None:
            stack.push_async_callback(joints.close)
        stack.push_async_callback(service.close)
        await service.open()
        body.wheels = service
        if joints is not None:
            joints.begin(service, wheels)

    def _joints(self) -> JointService | None:
        """The driver of the joints, if there are any."""
        if all(skill.joint is None for skill in self.wiring.settings.skills.values()):
            return None
        from hvcpd.daemon.skill_hosting import JointService

        return JointService(self.wiring.settings)

    async def settled(self) -> None:
        """Wait until wheels and memory are idle; for simulations that control the time."""
        begun = (self._body.wheels, self._name_learning, self._adaptation)
        for part in (*begun, self._channel, self._second, self._body.journal, self._pose):
            if part is not None:
                await part.settled()

    async def _live(self, robot: Robot, sound: SoundService, learning: NameLearning) -> None:
        self.listening = True
        wheels = self._body.wheels
        while not self._has_left(robot):
            block = await sound.read()
            robot.report_latency(sound.latency_s)
            if block.disturbed or sound.overload.standing:
                robot.disturb()
            reading = wheels.take_reading() if wheels is not None else None
            self._keep_time(robot, time.time())
            self._look_at_button()
            robot.is_held_down = self._held_down
            output = robot.step(block.samples, reading, block.lost)
            if wheels is not None:
                wheels.serve(output.wheels, robot.now)  # first of all: a halt is not to wait
            sound.write(output.sound)
            self._clips.take(block.samples, robot.now, output.records)
            self._control.note(robot, block.samples, reading, output)
            self._body.journal.write(output.records, robot.now)
            self._pose.note(robot.odometry.pose, robot.odometry.last, robot.now)
            learning.take(output.records)
            if self._adaptation is not None:
                self._adaptation.take(output.records)
            for record in output.records:
                log_record(record, self.wiring.tasks)
            self._tell_manager(robot, sound)
            await asyncio.sleep(0)  # signals and finished work get their turn even while sound waits

    def _keep_time(self, robot: Robot, wall_s: float) -> None:
        """Tasks are due again, quiet hours begin and end, and keys come of age and expire."""
        c = robot.coordination
        if (ring := self.wiring.ring_now()) is not None:
            robot.set_clock(self.wiring.wall_s(), ring)
        if c.board.recurs and (known_s := self.wiring.known_s(wall_s)) is not None:
            c.set_clock(known_s - robot.now, robot.now)
        role = self.wiring.with_talk(c.role, wall_s)
        if role is not c.role:
            c.reconfigure(robot.now, role)
            _log.info("talk", talk=role.talk.value, level_db=role.softly_db)

    def _tell_manager(self, robot: Robot, sound: SoundService) -> None:
        """Only here: a block came, the robot took its step, and the loop turns.

        While the card is gone, blocks without sound count too: a new process would not bring it back.
        """
        self._manager.beat()
        if self._leave_until_s is None:
            self._manager.status(self._state_of(robot, sound))

    def _state_of(self, robot: Robot, sound: SoundService) -> str:
        if not sound.flowing:
            return NO_SOUND
        if sound.deaf:
            return DEAF
        if sound.overload.standing:
            return f"{TOO_BUSY}: sound is lost or late"
        stands = STOPPED if robot.coordination.knowledge.latched else None
        return "; ".join(filter(None, (self._listens, stands, self._body.preparation.text)))

    def _has_left(self, robot: Robot) -> bool:
        if self._leave_until_s is None:
            return False
        return robot.now >= self._leave_until_s or (robot.coordination.has_left and not robot.speaking)

    def _tell_start(self, memory: MemoryPlan, here: KeptPose | None) -> None:
        settings = self.wiring.settings
        states = [state for state, _ in memory.tasks.values()]
        _log.info(
            "starting",
            name=settings.name,
            team=settings.team,
            mode=settings.mode,
            tasks=len(self.wiring.tasks.tasks),
            done_before=states.count("done"),
        )
        if here is not None:
            _log.warning(
                "going on where it was",
                x_m=round(here.pose.x_m, 2),
                y_m=round(here.pose.y_m, 2),
                reason="the daemon did not end normally; if somebody carried the robot to its "
                "start, restart the service",
            )
        if states.count("done") == len(self.wiring.tasks.tasks):
            files = f"{settings.memory_path} and {self.wiring.latch_path}"
            _log.warning(
                "nothing left to do",
                reason=f"every task is already done; to start afresh, stop the daemon and delete {files}",
            )
