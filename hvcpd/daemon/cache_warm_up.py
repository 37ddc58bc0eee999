"""Words made into the cache before they are needed, in the order of need: making one takes milliseconds on a desktop
computer, a tenth of a second on a Raspberry Pi, and sound may not be late.

A robot listens once it has its peers' words, speaks once it has its own, and then makes what it hears spelled names and
its peers' waveforms by.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import structlog

from hvcpd.assembly.make import SLOW, phrasebook_of, robot_voice, word_bank
from hvcpd.assembly.plan import RobotPlan
from hvcpd.assembly.sound import Sound
from hvcpd.daemon.allocator import give_back_memory
from hvcpd.errors import unwritable
from hvcpd.robot.robot import Robot
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.speaker import PITCH_STEPS, Speaker, UnitPosition
from hvcpd.synthesis.voices import Voice

LOGGED_EVERY_S = 5.0
"""Between two lines in the log. A start with all words there takes less, and has none."""
SHOWN_EVERY_S = 1.0
"""Between two texts for `hvcpctl status` and the service manager."""

_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class RenderJob:
    """Words to render, one at a time; `what` describes them to people."""

    what: str
    words: tuple[str, ...]
    make: Callable[[str], object]


class Preparation:
    """Carries jobs out, in any thread, until `stop`, and shows the progress: in `text`, by `report` and in the log."""

    def __init__(
        self,
        report: Callable[[str], None] = lambda _: None,
        clock: Callable[[], float] = time.monotonic,
        logged_every_s: float = LOGGED_EVERY_S,
    ) -> None:
        """`report` is called with each new text by the thread that carries the jobs out; `clock` is monotonic, s."""
        self._report = report
        self._clock = clock
        self._logged_every_s = logged_every_s
        self.done = self.total = 0
        """Number of words that are ready, and of all words of the present jobs."""
        self._logged_s = self._shown_s = 0.0
        self.text: str | None = None
        """The words that are being prepared; None: nothing."""
        self._stopped = False

    def stop(self) -> None:
        """Have this and all later work end after one more word."""
        self._stopped = True

    def goes_on(self) -> bool:
        """Whether nobody has stopped it."""
        return not self._stopped

    def run(self, jobs: Iterable[RenderJob]) -> None:
        """Carry the jobs out."""
        jobs = tuple(jobs)
        self._begin(sum(len(job.words) for job in jobs))
        for job in jobs:
            for word in job.words:
                if self._stopped:
                    break
                self._show(job.what)
                job.make(word)
                self.done += 1
        self.ended()

    def counted(self, what: str, total: int) -> Callable[[], bool]:
        """Return `goes_on` with progress, to call before each of `total` steps of making `what`; then call `ended`."""
        self._begin(total)

        def step() -> bool:
            self._show(what)
            self.done = min(self.done + 1, total)
            return self.goes_on()

        return step

    def ended(self) -> None:
        """The work is over."""
        self.text = None

    def _begin(self, total: int) -> None:
        self.done, self.total = 0, total
        self._logged_s = self._clock()
        self._shown_s = self._logged_s - SHOWN_EVERY_S

    def _show(self, what: str) -> None:
        now_s = self._clock()
        if now_s - self._shown_s >= SHOWN_EVERY_S:
            self._shown_s = now_s
            self.text = f"preparing words: {what}, {self.done} of {self.total}"
            self._report(self.text)
        if now_s - self._logged_s >= self._logged_every_s:
            self._logged_s = now_s
            _log.info("rendering words", what=what, done=self.done, of=self.total)


class CacheWarmUp:
    """Renders one robot's words into the cache. Every method may take minutes, so call it in another thread; without a
    cache none does anything. What `preparation` has stopped renders no more.
    """

    def __init__(self, plan: RobotPlan, sound: Sound, preparation: Preparation | None = None) -> None:
        self._plan = plan
        self._sound = sound
        self.preparation = preparation or Preparation()
        self._book = phrasebook_of(plan, plan.team.names)
        named = {robot_voice(name, sound): name for name in plan.peers(plan.team.names)}
        self._peers = tuple(named.values())
        """One robot of each voice that is listened for."""

    def before_listening(self) -> None:
        """Render the templates: the words of the peers."""
        banks = {name: word_bank(self._book, self._sound.speaker_of(name)) for name in self._peers}
        self._run(RenderJob(f"{name}'s words", tuple(b), b.__getitem__) for name, b in banks.items())

    def tell_unkept(self) -> None:
        """Log why rendered words could not be kept, if so: each start then takes as long as the first."""
        cache = self._sound.cache
        if cache is not None and cache.fault is not None:
            reason = unwritable(cache.folder, cache.fault, "see who may write there")
            _log.warning("words not kept", reason=reason, effect="each start renders them again")

    def before_speaking(self) -> None:
        """Render all words that the robot may say, at its usual rate; until then it must not speak."""
        self._run([self._own_words(self._plan.role.speech.slowly)])

    def the_rest(self, robot: Robot) -> None:
        """Render templates of spelled letters, the peers' waveforms, and the robot's own words at the other rate, for
        slow repetitions. Then delete units that have long not been used."""
        letters = tuple(self._book.spelling_graph.words) if self._plan.team.strangers else ()
        voices = self._sound.every_voice()
        self._run(RenderJob(f"letters in the voice {each.name}", letters, self._in_voice(each)) for each in voices)
        robot.prepare(self.preparation.counted("the others' sentences", self._n_waveforms()))
        self.preparation.ended()
        give_back_memory()  # 15 MB, of making the templates of spelled names; what follows may take minutes
        self.at_the_other_rate()
        if self._sound.cache is not None and self.preparation.goes_on():
            self._sound.cache.tidy(time.time())

    def at_the_other_rate(self) -> None:
        """Render the robot's own words at the rate of its repetitions: slow, unless it always speaks slowly."""
        self._run([self._own_words(not self._plan.role.speech.slowly)])

    def learn(self, name: str) -> None:
        """Render a name that the robot may say from now on."""
        self._run([_said("a name", self._sound.speaker_of(self._plan.role.name), (name.lower(),))])

    def say(self, words: Iterable[str]) -> None:
        """Render words of new tasks, which the robot may say from now on."""
        speaker = self._sound.speaker_of(self._plan.role.name, SLOW if self._plan.role.speech.slowly else 1.0)
        self._run([_said("words of new tasks", speaker, words)])

    def _run(self, jobs: Iterable[RenderJob]) -> None:
        if self._sound.cache is not None:
            self.preparation.run(jobs)

    def _in_voice(self, voice: Voice) -> Callable[[str], object]:
        """Return a function that renders the templates of a word; each word has a speaker: a shared one keeps 2 MB."""
        return lambda word: self._sound.speaker_in(voice).templates(word)

    def _n_waveforms(self) -> int:
        """Steps of `Robot.prepare`, as far as that is known before."""
        rates = sum(1 if name.lower() in self._sound.recorded else 2 for name in self._peers)
        return rates * len(self._book.marked_graph.words) * len(PITCH_STEPS)

    def _own_words(self, slowly: bool) -> RenderJob:
        name, speaker = self._plan.role.name, self._sound.speaker_of(self._plan.role.name, SLOW if slowly else 1.0)
        words = {*self._book.marked_graph.words, *self._book.spelling_graph.words}
        return _said(f"{name}'s own words{', slowly' if slowly else ''}", speaker, words)


def _said(what: str, speaker: Speaker, words: Iterable[str]) -> RenderJob:
    def make(word: str) -> None:
        for position in UnitPosition:
            for pitch in PITCH_STEPS:
                for place in (None, *Place):
                    speaker.unit(word, position, pitch, place)

    return RenderJob(what, tuple(sorted(words)), make)
