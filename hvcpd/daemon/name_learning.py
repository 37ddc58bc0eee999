"""Names that a robot learns while it lives: made ready in a thread, for it takes a second or more."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Sequence

import structlog

from hvcpd.assembly.name_registry import NameRegistry
from hvcpd.config.tasks import TaskRepository
from hvcpd.daemon.allocator import give_back_memory
from hvcpd.daemon.cache_warm_up import CacheWarmUp
from hvcpd.errors import PhraseError
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.recognition.stages import SpeechRecogniser
from hvcpd.robot.records import LearnName, Record
from hvcpd.robot.robot import Robot

ADOPTED_S = 10.0
"""By then (sample clock) the robot has what it learned, unless somebody speaks without end, and what it had is free."""

Rendered = Callable[[], Awaitable[None]]

_log = structlog.get_logger(__name__)


async def at_once() -> None:
    """Do not wait: no other process renders."""


class NameLearning:
    """Answers a robot's LearnName records, one after the other."""

    def __init__(
        self,
        robot: Robot,
        registry: NameRegistry,
        warm_up: CacheWarmUp,
        rendered: Rendered = at_once,
    ) -> None:
        """`rendered` waits until another process has rendered the words that the robot does not need at once."""
        self._robot = robot
        self._registry = registry
        self._warm_up = warm_up
        self._goes_on = warm_up.preparation.goes_on
        self._rendered = rendered
        self._turn = asyncio.Lock()
        self._under_way: set[asyncio.Task[object]] = set()
        self._tidy_s = robot.now + ADOPTED_S  # the first words said have needed some, too

    def take(self, records: Iterable[Record]) -> None:
        """Begin to learn each name in these records; call it at every block."""
        if self._robot.now >= self._tidy_s:
            self._tidy_s = math.inf
            give_back_memory()
        for record in records:
            if isinstance(record, LearnName):
                self._begin(self._learn(record.name))

    def _begin(self, lesson: Coroutine[None, None, object]) -> None:
        task: asyncio.Task[object] = asyncio.get_running_loop().create_task(lesson)
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    def join(self, names: Sequence[str]) -> None:
        """Begin to know those of these names who were enrolled meanwhile, by name and voice, and more words of others;
        no more expect the voice of who is enrolled no more."""
        self._begin(self._join(names))

    def retask(self, tasks: TaskRepository, then: Callable[[], None]) -> None:
        """Begin to prepare the words of these tasks, in place of all others; call `then` once the robot knows them."""
        self._begin(self._retask(tasks, then))

    async def _retask(self, tasks: TaskRepository, then: Callable[[], None]) -> None:
        async with self._turn:
            try:
                ready = await asyncio.to_thread(self._make_tasks_ready, tasks)
            except PhraseError as error:
                _log.warning("tasks not taken", reason=str(error))
                return
            self._robot.adopt(*ready, then)
            self._tidy_s = self._robot.now + ADOPTED_S
            _log.info("tasks learned", tasks=", ".join(str(task.number) for task in tasks.tasks))

    def _make_tasks_ready(self, tasks: TaskRepository) -> tuple[Phrasebook, SpeechRecogniser]:
        known = frozenset(self._robot.phrasebook.marked_graph.words)
        book, recogniser = self._registry.retask(tasks)
        self._warm_up.say(frozenset(book.marked_graph.words) - known)
        recogniser.prepare(self._goes_on)
        return book, recogniser

    def prepare(self) -> None:
        """Begin to make the robot's own words ready, until when it is silent, and then all else; until it has the other
        robots' sentences, noise hides more of them, and it hears no names being spelled."""
        self._robot.is_silent = True
        self._begin(self._prepare())

    async def _prepare(self) -> None:
        async with self._turn:
            await asyncio.to_thread(self._warm_up.before_speaking)
            self._robot.is_silent = False
            await self._rendered()
            await asyncio.to_thread(self._warm_up.the_rest, self._robot)
            give_back_memory()
            _log.info("waveforms of the others' voices ready")

    async def _join(self, names: Sequence[str]) -> None:
        async with self._turn:
            self._registry.forget_people()
            self._robot.expect(self._registry.voices)
        learned = [await self._learn(name, given=True) for name in names]
        if not any(learned):  # else the new ears know everything
            async with self._turn:
                await asyncio.to_thread(self._robot.prepare, self._goes_on)
                give_back_memory()

    async def settled(self) -> None:
        """Wait until nothing is being learned."""
        while self._under_way:
            await asyncio.wait(self._under_way)

    async def close(self) -> None:
        """Stop learning."""
        self._warm_up.preparation.stop()
        for lesson in self._under_way:
            lesson.cancel()
        await self.settled()

    async def _learn(self, name: str, given: bool = False) -> bool:
        """Learn a name; return whether that succeeded."""
        async with self._turn:
            if given and name.lower() not in self._registry.people:
                return False  # removed again meanwhile
            if self._registry.knows(name):  # it was spelled twice, or is enrolled now
                if given:
                    self._registry.mark_given(name)
                    self._robot.expect(self._registry.voices)
                return False
            try:
                self._robot.adopt(*await asyncio.to_thread(self._make_ready, name, given))
            except PhraseError as error:
                _log.warning("name not learned", name=name, reason=str(error))
                return False
            self._robot.expect(self._registry.voices)
            self._tidy_s = self._robot.now + ADOPTED_S
            _log.info("name learned", name=name, names=", ".join(self._registry.names))
            return True

    def _make_ready(self, name: str, given: bool) -> tuple[Phrasebook, SpeechRecogniser]:
        ready = self._registry.learn(name, given)
        self._warm_up.learn(name)
        ready[1].prepare(self._goes_on)
        return ready
