"""The records of a robot, and the output of one step. Times are seconds of its sample clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hvcpd.coordination.actions import SaveChange, SaveDue, SavePeer, SaveStopped, SaveTask
from hvcpd.language.messages import Utterance
from hvcpd.ports import Samples, WheelCommand
from hvcpd.security.trust import Trust
from hvcpd.skills.life import Call, Order, Report, SkillState


@dataclass(frozen=True)
class SaidRecord:
    """The robot begins to say this at `at_s`, as people speak in noise or plainly; it takes `duration_s`."""

    at_s: float
    utterance: Utterance
    text: str
    duration_s: float
    for_noise: bool = False


@dataclass(frozen=True)
class UnsaidRecord:
    """The robot left this out: it has a name, a task or a place that was forgotten since it was to be said."""

    at_s: float
    utterance: Utterance


@dataclass(frozen=True)
class HeardRecord:
    """The robot understood this sentence; a "stop" heard by itself over other talk has neither confidence nor SNR
    (NaN)."""

    at_s: float
    utterance: Utterance
    text: str
    start_s: float
    end_s: float
    confidence: float
    snr_db: float
    voice: str
    words: tuple[tuple[str, float, float], ...] = ()
    """Each word, and where it was heard to begin and to end, s."""
    trust: Trust = Trust.OPEN
    """The verdict of its seal."""


@dataclass(frozen=True)
class GarbledRecord:
    """The robot noticed speech that it could not understand; `addressed`: by its name it was for this robot."""

    at_s: float
    start_s: float
    end_s: float
    addressed: bool = False


@dataclass(frozen=True)
class EchoRecord:
    """The robot heard its own words come back later than the known delay, and ignored them."""

    at_s: float
    start_s: float
    end_s: float


@dataclass(frozen=True)
class HoldRecord:
    """The robot stood still from `at_s` to `until_s` for speech that sounded like "stop" and turned out to be other
    talk."""

    at_s: float
    until_s: float


@dataclass(frozen=True)
class RangeRecord:
    """The robot has measured how far `peer` is, m, with this standard deviation; not `sure`: perhaps it measured an
    echo, or somebody moved."""

    at_s: float
    peer: str
    distance_m: float
    deviation_m: float
    sure: bool

    @property
    def note(self) -> str:
        """As an event tells it."""
        unsure = "" if self.sure else ", unsure: perhaps an echo, or somebody moved"
        return f"{self.peer} is {self.distance_m:.2f} m away, ± {self.deviation_m:.2f} m{unsure}"


@dataclass(frozen=True)
class DoubtRecord:
    """The robot did not believe a sentence of `speaker`: the reason, and for how long it will not listen to it (s)."""

    at_s: float
    speaker: str | None
    text: str
    why: str
    silence_s: float | None = None

    @property
    def note(self) -> str:
        """As in the transcript."""
        return f"not believed: {self.why}"


@dataclass(frozen=True)
class VoiceRecord:
    """A speaker that called itself `speaker` did not have that one's voice, `expected`, but `voice`."""

    at_s: float
    speaker: str
    voice: str
    expected: str

    @property
    def note(self) -> str:
        """As in the transcript."""
        return f"another voice than {self.speaker}'s: {self.voice}, not {self.expected}"


@dataclass(frozen=True)
class SaveCounter:
    """Remember the value that this counter of seals or codes has reached."""

    name: str
    value: int


@dataclass(frozen=True)
class PerformedRecord:
    """The robot carried out the actions at a task's place."""

    at_s: float
    task: int


@dataclass(frozen=True)
class StuckRecord:
    """The robot did not get where an action of `task` leads (0: a person's order to move): the reason."""

    at_s: float
    task: int
    reason: str

    @property
    def note(self) -> str:
        """As in the transcript."""
        return f"driving failed: {self.reason or 'no reason given'}"


@dataclass(frozen=True)
class SkillRecord:
    """A skill that the robot uses has changed its state, or reports its progress."""

    at_s: float
    call: Call
    report: Report

    def shown(self) -> dict[str, Any]:
        """As in JSON, and as the fields of the event."""
        call, report = self.call, self.report
        return {
            "call": call.number,
            "task": call.task,
            "skill": call.skill,
            "state": report.state.name.lower(),
            "share": report.share,
            "text": report.text,
            "arguments": dict(call.arguments),
            "results": dict(report.results),
        }

    @property
    def note(self) -> str | None:
        """As in the transcript, if it went wrong."""
        if self.report.state is not SkillState.FAILED:
            return None
        return f"{self.call.skill} failed: {self.report.text or 'no reason given'}"


@dataclass(frozen=True)
class LearnName:
    """A speaker has spelled a name that is new here: the robot's owner is to answer with `Robot.adopt`."""

    name: str


Record = (
    SaidRecord
    | UnsaidRecord
    | HeardRecord
    | GarbledRecord
    | EchoRecord
    | HoldRecord
    | RangeRecord
    | DoubtRecord
    | VoiceRecord
    | PerformedRecord
    | StuckRecord
    | SkillRecord
    | LearnName
    | SaveCounter
    | SaveTask
    | SaveDue
    | SaveChange
    | SavePeer
    | SaveStopped
)


@dataclass(frozen=True)
class RobotOutput:
    """One step's output: sound to be played next (as long as the sound that was heard), wheel speeds, events, and
    orders for the clients that offer skills."""

    sound: Samples
    wheels: WheelCommand
    records: tuple[Record, ...]
    skills: tuple[Order, ...] = ()
