"""The commands of the control socket. Each answers from what the robot knows at that moment, and none waits for it."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import asdict
from typing import Any

import structlog

from hvcpd import __version__
from hvcpd.coordination.addressing import is_for
from hvcpd.coordination.saying import announced
from hvcpd.daemon import base_request_handler, skill_service
from hvcpd.daemon.control_events import FREQUENT, KINDS
from hvcpd.daemon.control_protocol import NUMBER, PROTOCOL, RefusalError, Request, checked_arguments
from hvcpd.daemon.control_server import Client, ControlServer
from hvcpd.daemon.control_status import Body, status_of, tasks_of, words_of
from hvcpd.daemon.reloading import Reloader
from hvcpd.errors import HvcpdError, NotDoneError, PhraseError, StoreError, did_you_mean
from hvcpd.language.marks import without_mark
from hvcpd.language.messages import Resume, Stop, ToAll, Utterance, for_robots
from hvcpd.robot.robot import Robot

MAX_ROWS = 100
"""Lines of a transcript in one reply, about 30 kB."""
MAX_TEXT_LENGTH = 200
"""Characters of a sentence to say; the phrasebook's longest are half of this."""

CHANGES_OF_TASKS = ("again", "skip", "add", "remove")
"""What can be wanted of a task while robots work. To add and to remove one is this robot's own affair; of the rest it
tells the others."""

PERFORM = "perform"
"""The events for clients that offer skills: calls only."""

Arguments = dict[str, Any]
Result = Mapping[str, Any]

_log = structlog.get_logger(__name__)


class RequestHandler:
    """Carries out requests; those that change something are logged with the client."""

    def __init__(self, body: Body, reloader: Reloader) -> None:
        self._body = body
        self._reloader = reloader
        self.server = ControlServer(self.serve, self.hello, body.skills.gone)

    def hello(self) -> Result:
        """The first line that each client gets."""
        return {
            "event": "hello",
            "protocol": PROTOCOL,
            "name": self._body.wiring.settings.name,
            "version": __version__,
        }

    async def serve(self, request: Request, client: Client) -> Result:
        """Carry a request out. Raises RefusalError."""
        command = COMMANDS.get(request.command)
        if command is None:
            hint = did_you_mean(request.command[:40], COMMANDS)
            raise RefusalError("unknown_command", f"unknown command {request.command[:40]!r}; {hint}")
        known, run = command
        arguments = checked_arguments(request, known)
        if request.command in CHANGING:
            caller = client.caller
            shown = {name: value for name, value in arguments.items() if name != "text"}  # it may have a person's code
            _log.info("asked to", command=request.command, **shown, pid=caller.pid, uid=caller.uid)
        return await run(self, arguments, client)

    async def status(self, _: Arguments, _client: Client) -> Result:
        return status_of(self._body)

    async def tasks(self, _: Arguments, _client: Client) -> Result:
        robot = self._robot()
        return {"now_s": round(robot.now, 3), "tasks": tasks_of(robot), "words": words_of(robot)}

    async def say(self, arguments: Arguments, _client: Client) -> Result:
        text = arguments.get("text", "")
        if not 0 < len(text) <= MAX_TEXT_LENGTH:
            raise RefusalError("bad_argument", f"text: give a sentence of 1 to {MAX_TEXT_LENGTH} characters")
        robot = self._robot()
        knowledge = robot.coordination.knowledge
        try:
            utterance = for_robots(robot.phrasebook.parse_text(text))
        except PhraseError as error:
            raise RefusalError("not_in_phrasebook", str(error)) from None
        if isinstance(utterance.statement, Stop) and is_for(knowledge, utterance.addressee):
            self.halt()  # it does not hear itself
        reason = robot.coordination.say(utterance, robot.now)
        if reason is not None:
            raise RefusalError("refused", reason)
        return {"text": robot.phrasebook.write(without_mark(announced(knowledge, utterance)))}

    async def task(self, arguments: Arguments, _client: Client) -> Result:
        wanted, number = arguments.get("do"), arguments.get("number", 0)
        if wanted not in CHANGES_OF_TASKS:
            raise RefusalError("bad_argument", f"do: give one of {', '.join(CHANGES_OF_TASKS)}")
        robot = self._robot()
        if wanted == "add":
            return await self._renewed(self._reloader.add(arguments.get("task", {})))
        if wanted == "remove":
            return await self._renewed(self._reloader.remove(number))
        reason = robot.coordination.change(number, wanted == "skip", robot.now)
        if reason is not None:
            known = self._body.wiring.tasks.by_number(number) is not None
            raise RefusalError("refused" if known else "bad_argument", reason)
        return {"number": number, "name": robot.coordination.board[number].definition.name, "do": wanted}

    async def stop(self, _: Arguments, _client: Client) -> Result:
        before = self.halt()
        return {"before": before, **await self._kept()}

    def halt(self) -> bool:
        """Stop the robot, or have it begin stopped if it is not ready yet. Returns whether it was stopped before."""
        if self._body.wheels is not None:
            self._body.wheels.halt()
        self._body.skills.halt()
        robot = self._body.robot
        if robot is None:
            before, self._body.journal.stopped = self._body.journal.stopped, True
        else:
            before = not robot.coordination.stop(robot.now)
        self._body.journal.latch.stop()
        return before

    async def resume(self, arguments: Arguments, _client: Client) -> Result:
        robot = self._robot()
        if self._body.is_held_down:
            text = "the stop button is pressed, or its wire is broken; release the button, or mend the wire, first"
            raise RefusalError("refused", text)
        before, untold = robot.coordination.resume(robot.now), None
        if arguments.get("all"):  # before anything else is heard: a "stop" that comes now withdraws it
            call = Utterance(self._body.wiring.settings.name, ToAll(), None, Resume())
            untold = robot.coordination.say(call, robot.now)
        self._body.journal.latch.stop(False)
        return {"before": before, **await self._kept(), "untold": untold}

    async def _kept(self) -> Result:
        """Wait until it is on the disk that the robot is stopped or free; which of them it then is."""
        unkept = await self._body.journal.latch.kept()
        stopped = self._body.robot is None or self._body.robot.coordination.knowledge.latched
        return {"stopped": stopped, "kept": unkept is None, "reason": unkept}

    async def base(self, arguments: Arguments, _client: Client) -> Result:
        if self._body.base is None:
            driver = self._body.wiring.settings.wheels.driver
            if driver == "ros":
                raise RefusalError("starting", "the robot is still starting; try again in a moment")
            text = f"hvcpd drives the wheels (wheels.driver is {driver}); set it to ros to leave them to ROS"
            raise RefusalError("refused", text)
        self._body.base.take(arguments)
        return {}

    async def offer(self, arguments: Arguments, client: Client) -> Result:
        result = self._body.skills.offer(client, arguments.get("skills", []))
        self.server.follow(client, client.wanted | {PERFORM})
        return result

    async def progress(self, arguments: Arguments, client: Client) -> Result:
        self._body.skills.progress(client, arguments)
        return {}

    async def done(self, arguments: Arguments, client: Client) -> Result:
        self._body.skills.done(client, arguments)
        return {}

    async def failed(self, arguments: Arguments, client: Client) -> Result:
        self._body.skills.failed(client, arguments)
        return {}

    async def transcript(self, arguments: Arguments, _client: Client) -> Result:
        after, since_s = arguments.get("after", 0), float(arguments.get("since_s", -math.inf))
        limit = arguments.get("limit", MAX_ROWS)
        if not 1 <= limit <= MAX_ROWS:
            raise RefusalError("bad_argument", f"limit: give a number from 1 to {MAX_ROWS}")
        if after < 0:
            raise RefusalError("bad_argument", "after: give the number of a line, or 0")
        try:
            rows = await self._body.journal.transcript(after, since_s, limit)
        except StoreError as error:
            raise RefusalError("failed", str(error)) from None
        return {"rows": [{"number": row.number, "wall_s": row.wall_s, **asdict(row.record)} for row in rows]}

    async def config(self, _: Arguments, _client: Client) -> Result:
        return {"settings": [asdict(each) for each in self._reloader.sources]}

    async def reload(self, _: Arguments, _client: Client) -> Result:
        self._robot()
        return await self._renewed(self._reloader.reload())

    async def _renewed(self, renewal: Awaitable[Result]) -> Result:
        try:
            return await renewal
        except NotDoneError as error:
            raise RefusalError("failed", str(error)) from None
        except HvcpdError as error:
            raise RefusalError("bad_settings", str(error)) from None

    async def subscribe(self, arguments: Arguments, client: Client) -> Result:
        kinds = arguments.get("events", sorted(KINDS.keys() - FREQUENT))
        for kind in kinds:
            if not isinstance(kind, str) or kind not in KINDS:
                raise RefusalError(
                    "bad_argument", f"events: there is no {str(kind)[:40]!r}; {did_you_mean(str(kind)[:40], KINDS)}"
                )
        if "sound" in kinds and not self._body.wiring.settings.control.sound:
            raise RefusalError(
                "bad_argument", "its settings do not let others have what it hears; set `control: {sound: true}`"
            )
        self.server.follow(client, frozenset(kinds) | (client.wanted & {PERFORM}))
        return {"events": sorted(set(kinds))}

    def _robot(self) -> Robot:
        if self._body.robot is None:
            raise RefusalError(
                "starting", f"{self._body.wiring.settings.name} is still starting; try again in a moment"
            )
        return self._body.robot


Command = Callable[[RequestHandler, Arguments, Client], Awaitable[Result]]
ArgumentTypes = dict[str, tuple[type, ...]]

COMMANDS: dict[str, tuple[ArgumentTypes, Command]] = {
    "status": ({}, RequestHandler.status),
    "tasks": ({}, RequestHandler.tasks),
    "say": ({"text": (str,)}, RequestHandler.say),
    "task": ({"do": (str,), "number": (int,), "task": (dict,)}, RequestHandler.task),
    "stop": ({}, RequestHandler.stop),
    "resume": ({"all": (bool,)}, RequestHandler.resume),
    "base": (base_request_handler.ARGUMENTS, RequestHandler.base),
    "offer": (skill_service.OFFER, RequestHandler.offer),
    "progress": (skill_service.PROGRESS, RequestHandler.progress),
    "done": (skill_service.DONE, RequestHandler.done),
    "failed": (skill_service.FAILED, RequestHandler.failed),
    "transcript": ({"after": (int,), "since_s": NUMBER, "limit": (int,)}, RequestHandler.transcript),
    "config": ({}, RequestHandler.config),
    "reload": ({}, RequestHandler.reload),
    "subscribe": ({"events": (list,)}, RequestHandler.subscribe),
}
"""Each command with its arguments, none of which must be given but those of `say` and `task`."""

CHANGING = frozenset({"say", "task", "stop", "resume", "reload"})
"""Commands that are logged."""
