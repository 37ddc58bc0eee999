"""One robot, whole, without I/O: blocks of sound and encoder readings in; sound, wheel speeds and records out.

It never asks a clock: time is the number of samples that it has heard. So the daemon on a robot and twelve robots
in a test run the same code.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from hvcpd.config.tasks import Place
from hvcpd.coordination.actions import BreakOff, Halt, Perform, Say
from hvcpd.coordination.coordination import Coordination
from hvcpd.hardware.kinematics import Odometry
from hvcpd.language.messages import Spelled, Stop, Stopped, Utterance
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.words import spoken_as
from hvcpd.ports import SAMPLE_RATE_HZ, STANDSTILL, Samples, WheelCommand, WheelReading
from hvcpd.ranging.own_delay import OwnDelay
from hvcpd.recognition.barge_in import BargeInDetector
from hvcpd.recognition.events import Event as HearingEvent
from hvcpd.recognition.events import Garbled, KeywordEvent, Recognised, Released, Source, Urgent
from hvcpd.recognition.stages import SpeechRecogniser
from hvcpd.robot.holding import Holding
from hvcpd.robot.measures import Measures
from hvcpd.robot.own_voice import Acoustics, OwnVoice
from hvcpd.robot.performer import Outcome, Performer
from hvcpd.robot.records import (
    EchoRecord,
    GarbledRecord,
    HeardRecord,
    HoldRecord,
    LearnName,
    PerformedRecord,
    Record,
    RobotOutput,
    SaidRecord,
    UnsaidRecord,
    VoiceRecord,
)
from hvcpd.robot.sealing import Sealing, judged_by, written
from hvcpd.robot.speech_output import Mouth, delivered, meaning
from hvcpd.security.keys import KeyRing


class Robot:
    """See the module. `here` and the parts passed in are this robot's own; nothing is shared with another robot."""

    def __init__(
        self,
        coordination: Coordination,
        phrasebook: Phrasebook,
        recogniser: SpeechRecogniser,
        mouth: Mouth,
        odometry: Odometry,
        performer: Performer,
        acoustics: Acoustics,
        slow_mouth: Mouth,
        barge_in: BargeInDetector,
        sealing: Sealing | None,
        own_delay: OwnDelay,
        voices: Mapping[str, str],
        measures: Measures,
    ) -> None:
        """`sealing`: None without a key; `voices`: as for `expect`."""
        self.coordination = coordination
        self.phrasebook = phrasebook
        self.odometry = odometry
        self._recogniser = recogniser
        self._mouth = mouth
        self._slow_mouth = slow_mouth
        self.performer = performer
        self._barge_in = barge_in
        self._sealing = sealing
        self.expect(voices)
        self.measures = measures
        self._voice = OwnVoice(acoustics, own_delay)
        self._n_heard = 0
        self._busy = False
        self._holding = Holding()
        self._disturbed_until_s = 0.0
        self.is_silent = False
        """It listens and obeys, and holds its own sentences back, as if another speaker were talking."""
        self.is_held_down = False
        """Its stop button is pressed: it stops, and nothing releases it, not even for one block."""
        self._task = 0
        self._records: list[Record] = []
        self._strangers: dict[str, Recognised] = {}
        self._pending: tuple[Phrasebook, SpeechRecogniser] | None = None
        self._on_adopted: list[Callable[[], None]] = []

    @property
    def now(self) -> float:
        """The sample clock, s."""
        return self._n_heard / SAMPLE_RATE_HZ

    @property
    def speaking(self) -> bool:
        return self._voice.speaking

    @property
    def latency_s(self) -> float:
        """The delay with which the robot hears itself, as far as it knows."""
        return self._voice.latency_s

    def report_latency(self, latency_s: float) -> None:
        """The sound system's report of `Acoustics.latency_s`, which may change while the robot lives."""
        self._voice.report_latency(latency_s)

    def disturb(self) -> None:
        """Sound was lost or late until now: it does not show whose voice or name it is, nor that it is not its own."""
        self.measures.ranging.lost(self._n_heard)
        self._barge_in.disturb()
        self._disturbed_until_s = self.now

    def set_clock(self, wall_s: float | None, ring: KeyRing) -> None:
        """Set the time, seconds since 1970, for codes that depend on it, None if nobody knows it; and its keys."""
        if self._sealing is not None:
            self._sealing.guard.set_clock(None if wall_s is None else wall_s - self.now, ring)

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare recognition, while `go_on`. Takes seconds; another thread may do it."""
        self._recogniser.prepare(go_on)

    def expect(self, voices: Mapping[str, str]) -> None:
        """The recogniser's name for each speaker's voice, by the speaker's name in lower case."""
        self._voices = voices

    def adopt(
        self, phrasebook: Phrasebook, recogniser: SpeechRecogniser, then: Callable[[], None] | None = None
    ) -> None:
        """Understand other words, and then call `then`, once nobody speaks, and it is known whether "stop" was said."""
        self._pending = (phrasebook, recogniser)
        self._on_adopted += [then] if then is not None else []

    def step(self, heard: Samples, reading: WheelReading | None, lost: int | None = None) -> RobotOutput:
        """Live for one block.

        `heard`: the microphone's sound, shape (n,), float32; `reading`: of the wheels, None if they were not read;
        `lost`: number of samples lost before this block, 0 if it is unknown, None if none was. The returned sound has
        the same shape, for the next block. Without any sound (an empty block) the robot stands still, and waits.
        """
        if len(heard) == 0:
            return self._endure(lost or 0, reading)
        gap_events = self._skip(lost) if lost is not None else []
        self._finish_speaking()
        self._adopt_pending()
        masked = self._voice.masks(self.now)
        self._voice.hear(heard)
        events = [*gap_events, *self._recogniser.push(heard, masked=masked)]
        over_own_voice = self._barge_in.hear(heard, masked)
        self._n_heard += len(heard)
        self._locate(reading)
        self._set_channel(self._recogniser.busy, self.is_silent, now := self.now)
        for event in events:
            self._understand(event, now)
        for word in over_own_voice:
            self._hold(word, self._barge_in, now)
        self._heed_button(now)
        wheels = self._perform(now, reading)
        if now >= self.coordination.next_deadline():
            self.coordination.tick(now)
        halted = self._act(now)
        return self._output(len(heard), STANDSTILL if halted else wheels)

    def _output(self, n: int, wheels: WheelCommand) -> RobotOutput:
        self._records += self.performer.take_records(self.now)
        records, self._records = tuple(self._records), []
        self._barge_in.play(sound := self._voice.take(n))
        return RobotOutput(sound, wheels, records, self.performer.take_orders())

    def _endure(self, lost: int, reading: WheelReading | None) -> RobotOutput:
        """Time goes on without sound. Who hears nobody must not speak: for the floor the channel is in use. The
        interrupted sentence is said again later, and coordination waits: nobody could have answered meanwhile."""
        self._n_heard += lost
        self.disturb()
        now = self.now
        self._break_off(now)
        self._set_channel(True, True, now)
        self._locate(reading)
        for event in self._recogniser.lost(lost):
            self._understand(event, now)
        self._heed_button(now)  # nobody need speak to stop it
        self._act(now)
        if self.performer.busy:
            self.performer.rest(now)
        return self._output(0, STANDSTILL)

    def _locate(self, reading: WheelReading | None) -> None:
        if reading is not None:
            pose = self.odometry.update(reading)
            self.coordination.sensed(Place(pose.x_m, pose.y_m), reading.voltage_v)

    def _skip(self, lost: int) -> list[HearingEvent]:
        """Time goes on; the robot's own words wait, because nothing is played for blocks that were not handed out."""
        self._n_heard += lost
        self.disturb()
        self._barge_in.lost()
        self._voice.lose(lost / SAMPLE_RATE_HZ)
        return self._recogniser.lost(lost)

    def _adopt_pending(self) -> None:
        if self._pending is None or self._recogniser.busy or self._holding.since_s is not None:
            return  # only this recogniser can tell the reason for the halt
        (self.phrasebook, recogniser), self._pending = self._pending, None
        self._recogniser.adopt(recogniser)
        while self._on_adopted:
            self._on_adopted.pop(0)()
        for name, event in tuple(self._strangers.items()):
            if self.phrasebook.known_name(name) is not None:
                del self._strangers[name]
                judged = judged_by(self._sealing, self.phrasebook.parse(event.words), self.phrasebook, self.now)
                self.coordination.heard(judged.utterance, self.now, event.confidence, event.snr_db, judged.trust)

    def _is_stranger(self, utterance: Utterance, event: Recognised) -> bool:
        """Whether a spelled name is still to be learned; its owner is answered then."""
        spelled = utterance.statement
        if not isinstance(spelled, Spelled) or self.phrasebook.known_name(spelled.letters) is not None:
            return False
        self._strangers[name := utterance.speaker or spelled.letters] = event
        self._records.append(LearnName(name))
        return True

    def _finish_speaking(self) -> None:
        if self._voice.finished(self.now):
            self.coordination.spoken(self.now)
            self.measures.said(self._voice.latency_s, self.coordination, self.now)

    def _set_channel(self, busy: bool, muted: bool, now: float) -> None:
        self.coordination.mute(muted)
        if (busy := busy or muted) != self._busy:
            self._busy = busy
            self.coordination.channel(busy, now)

    def _understand(self, event: HearingEvent, now: float) -> None:
        start_s, end_s = event.start_sample / SAMPLE_RATE_HZ, event.end_sample / SAMPLE_RATE_HZ
        if isinstance(event, KeywordEvent):
            self._hold(event, self._recogniser, now)
            return
        utterance = meaning(event, self.phrasebook, self._voice.may_have_cut(start_s))
        if not isinstance(event, Recognised) or utterance is None:
            addressed = isinstance(event, Garbled) and event.addressed
            self._records.append(GarbledRecord(now, start_s, end_s, addressed))
            self.coordination.garbled(self._voice.overlapped(start_s, end_s), now, addressed)
            return
        if not isinstance(utterance.statement, Stop) and self._voice.returns(event.words, end_s):
            self._records.append(EchoRecord(now, start_s, end_s))
            return
        judged = judged_by(self._sealing, utterance, self.phrasebook, now)
        utterance, text = judged.utterance, written(judged.utterance, self.phrasebook)
        words = tuple((s.word, s.start_sample / SAMPLE_RATE_HZ, s.end_sample / SAMPLE_RATE_HZ) for s in event.spans)
        sure, snr_db = event.confidence, event.snr_db
        heard = HeardRecord(now, utterance, text, start_s, end_s, sure, snr_db, event.voice, words, judged.trust)
        self._records += (heard, *judged.records)
        speaker, is_torn = (utterance.speaker or "").lower(), start_s < self._disturbed_until_s
        if is_torn and speaker == self.coordination.role.name.lower() and self._voice.may_be_late(start_s):
            return  # its own words
        expected = self._voices.get(speaker, event.voice)
        if utterance.speaker is not None and event.voice != expected and not is_torn:
            self._records.append(VoiceRecord(start_s, utterance.speaker, event.voice, expected))
        if not self._is_stranger(utterance, event):
            self.coordination.heard(utterance, now, sure, snr_db, judged.trust, start_s, event.source is Source.PEOPLE)
            self._records += self.measures.understood(utterance, event, self.phrasebook, now)

    def _hold(self, event: KeywordEvent, detector: object, now: float) -> None:
        """Stand still at once for a possible "stop", whoever its addressee; go on if it was none, otherwise stay."""
        held_s = self._holding.take(event, detector, now)
        if isinstance(event, Released) and held_s is not None and self.performer.busy:
            self._records.append(HoldRecord(held_s, now))
        if not isinstance(event, Urgent):
            return
        start_s, end_s = event.start_sample / SAMPLE_RATE_HZ, event.end_sample / SAMPLE_RATE_HZ
        text = self.phrasebook.write(stop := Utterance(None, statement=Stop()))
        self._records.append(HeardRecord(now, stop, text, start_s, end_s, math.nan, math.nan, ""))
        self.coordination.heard(stop, now, confidence=0.0, began_s=start_s)

    def _heed_button(self, now: float) -> None:
        if self.is_held_down and not self.coordination.knowledge.latched:
            self.coordination.stop(now)

    def _perform(self, now: float, reading: WheelReading | None) -> WheelCommand:
        may_drive = self.coordination.may_drive(self.performer.way, now)
        if not self.performer.busy or self.coordination.knowledge.latched:  # a stop in this block ends it in `_act`
            return STANDSTILL
        if self._holding.since_s is not None or not may_drive:
            self.performer.rest(now)
            return STANDSTILL
        progress = self.performer.step(self.odometry.pose, now, reading)
        self._records += self.performer.take_records(now)
        if progress.remark is not None:
            self.coordination.remark(progress.remark, now)
        if progress.outcome is Outcome.DONE:
            self._done(now)
        elif progress.outcome is Outcome.FAILED:
            self.coordination.perform_failed(now, spoken_as(progress.reason, self.phrasebook.vocabulary.failures))
        return progress.wheels

    def _done(self, now: float) -> None:
        if self.coordination.at_place:
            self._records.append(PerformedRecord(now, self._task))
        self.coordination.performed(now)

    def _act(self, now: float) -> bool:
        """Carry out coordination's actions. Returns whether it asked for a halt."""
        halted, pending = False, list(self.coordination.actions(now))
        while pending:
            action = pending.pop(0)
            match action:
                case Say() if self.phrasebook.can_say(action.utterance):
                    self._say(action, now)
                case Say(utterance):
                    self._records.append(UnsaidRecord(now, utterance))
                    self.coordination.spoken(now)
                case Perform(task, actions):
                    self._task = task
                    self.performer.begin(actions, task)
                    if not actions:
                        self._done(now)
                        pending += self.coordination.actions(now)
                case Halt():
                    self.performer.cancel()
                    halted = True
                case BreakOff():
                    self._break_off(now)
                case _:
                    self._records.append(action)
        return halted

    def _break_off(self, now: float) -> None:
        """Nothing more of its sentence is heard."""
        if self._voice.break_off(now):
            self.coordination.spoken(now, cut=True)

    def _say(self, say: Say, now: float) -> None:
        if self._sealing is not None:
            sealed, records = self._sealing.said(say.utterance, self.phrasebook, now)
            say = replace(say, utterance=sealed)
            self._records += records
        utterance = say.utterance
        speech = delivered(self._slow_mouth if say.slowly else self._mouth, say, self.phrasebook)
        duration_s = len(speech) / SAMPLE_RATE_HZ
        self.measures.ranging.say(utterance, speech, self._n_heard)
        self._voice.begin(speech, self.phrasebook.render(utterance), now)
        # Stopped, it need not stop again; and a filter out of step would take the robot's own voice for any sentence.
        may_stop = not isinstance(utterance.statement, Stop | Stopped)
        if may_stop and self._voice.is_latency_known:
            self._barge_in.begin(self._n_heard, self._voice.latency_s)
        self._records.append(SaidRecord(now, utterance, written(utterance, self.phrasebook), duration_s, say.for_noise))
