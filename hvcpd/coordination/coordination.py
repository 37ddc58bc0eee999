"""One robot's part in the conversation: a state machine without I/O, in the style of h11 and aioquic.

Its owner calls `heard`, `channel`, `spoken`, `performed`, … with the time, and `tick` when `next_deadline` is due;
after each call `actions` returns the actions to carry out. Times are seconds of the robot's sample clock.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.tasks import Place, TaskDefinition
from hvcpd.coordination import (
    ahead,
    changing,
    chatter,
    composing,
    deadlines,
    effects,
    halting,
    hearing,
    ranging,
    repair,
    right_of_way,
    saying,
    schedule,
    teaming,
    trusting,
)
from hvcpd.coordination.actions import Action, Rng, Role, SaveChange, SaveDue, SavePeer, SaveTask, Timing
from hvcpd.coordination.addressing import answer_slots, note_presence, whose_turn
from hvcpd.coordination.board import Board
from hvcpd.coordination.floor import Floor, Order, Urgency, round_of_turns
from hvcpd.coordination.knowledge import Heard, Knowledge
from hvcpd.coordination.peers import Peers, team_of
from hvcpd.coordination.states import DEPARTING, NEWCOMER, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m
from hvcpd.security.trust import Trust

SAME_WITHIN_S = 1.0
"""The same sentence, begun no later than this after it was understood, is its second saying: SECOND_GAP_S plus a margin
for late onset detection. A robot that waits for an answer does not speak again this soon."""
COUNTS_TWICE = (m.Stop, m.Resume)
"""Said again, each is no repetition: the robot may have been released meanwhile, or may need two to be sure."""
CLOCK_STEP_S = 1.0
"""A clock that differs by less was only read at another moment."""
ASKING = (m.Claim, m.Working, m.Completed, m.Failed, m.Left, m.Relayed)
"""Statements that any listener may confirm or object to, each in a slot of its own. Every other statement is answered
by one robot at most before a turn begins."""


class Coordination:
    """See the module. `remembered` are the tasks' states from the robot's store: number → (state, owner).

    `stopped`: it was stopped when it was switched off, and nobody has said "resume" since. `home` is the destination of
    "come back"; None: the first place that is sensed. `dues`: when the last completed occurrence of each recurring task
    was due, s since 1970; `changes`: the last change of each task, and whether it is left out since. `places`: those
    with room for only one robot.
    """

    def __init__(
        self,
        role: Role,
        tasks: Iterable[TaskDefinition],
        rng: Rng,
        timing: Timing | None = None,
        remembered: Mapping[int, tuple[str, str | None]] | None = None,
        now: float = 0.0,
        stopped: bool = False,
        home: Place | None = None,
        dues: Mapping[int, float] | None = None,
        changes: Mapping[int, tuple[int, bool]] | None = None,
        places: Iterable[SharedPlace] = (),
    ) -> None:
        timing = (timing or Timing()).for_speech(role.speech)
        board = Board(tasks, remembered or {}, now + timing.lease_s)
        self.board, self.peers = board, Peers(timing.absent_s, board.recurs)
        self.knowledge = me = Knowledge(role, timing, rng, board, self.peers, Floor(timing, rng, len(role.roster)))
        me.missed.any_work = me.missed.heard_work = bool(remembered)
        me.body.home = home
        right_of_way.take_places(me, places, now)
        for number, due_s in (dues or {}).items():
            board[number].due_s = due_s
        changing.remember(me, changes or {}, now)
        board.changed.clear()  # nothing has just been done
        me.acquaintance.unheard = me.roster - {role.name.lower()}
        me.acquaintance.all_heard_s = now + timing.meeting_s * (1 + len(role.roster))
        if stopped:
            me.state, me.latched = State.STOPPED, True
            halting.want_release_hint(me, now)
        else:
            me.arm(now, timing.wake_min_s + rng.random() * timing.wake_spread_s)

    def heard(
        self,
        utterance: m.Utterance,
        now: float,
        confidence: float = 1.0,
        snr_db: float | None = None,
        trust: Trust = Trust.OPEN,
        began_s: float | None = None,
        by_person: bool = False,
    ) -> None:
        """A sentence was understood, with a confidence of 0 to 1; `trust`: its seal's; `began_s`: when it began, if it
        took time to understand it; `by_person`: in no robot's voice. Its own name is never obeyed, unless it says
        "stop"."""
        me = self.knowledge
        if utterance.speaker is not None and utterance.speaker.lower() == me.role.name.lower():
            hearing.hear_namesake(me, utterance, trust, now)
            return
        speaker = utterance.speaker if (believed := trusting.admit(me, utterance, trust)) else None
        if (peer := me.peers.heard(speaker, now, team_of(utterance), by_person)) is not None:
            peer.confidence, peer.snr_db = confidence, snr_db
            me.do(SavePeer(peer.name, peer.team, now))
            note_presence(me, utterance, now)
        me.floor.answer_slots = answer_slots(me, now) if isinstance(m.parts(utterance)[-1].statement, ASKING) else 0
        me.current.objected &= me.floor.busy_since_s >= me.current.objected_s  # what was said decides
        me.floor.understood(now, self._order_after(whose_turn(utterance), now))
        is_second = self._is_second(utterance, believed, now)
        if is_second or (me.state in DEPARTING and not isinstance(utterance.statement, m.Stop)):
            return
        chatter.note_heard(me, utterance, snr_db, now)
        if not believed:
            trusting.refuse(me, utterance, trust, now)
            return
        given_up = utterance.statement.given_up if isinstance(utterance.statement, m.ConfirmedAnd) else ()
        for part in m.parts(utterance):
            schedule.heard(me, part.speaker or "", part.statement, now)
            hearing.react(me, Heard(part, 1.0 if trust.checks_words else confidence, now, given_up, began_s))
        only_hearsay = me.board.changed and not me.board.not_done()  # it asks while somebody is there to answer
        if (only_hearsay or me.timer_s == math.inf) and not me.board.all_done:
            me.reconsider(now)

    def garbled(self, over_own_speech: bool, now: float, addressed: bool = False) -> None:
        """Speech was not understood; over the robot's own it shows that nobody heard it. `addressed`: to it by name."""
        me = self.knowledge
        me.floor.answer_slots = answer_slots(me, now)
        me.floor.garbled(now)
        if me.floor.is_second or now < me.repair.foreign_until_s or me.state in DEPARTING:
            return  # its content is known, or of no use any more
        if me.state is State.MEETING:
            me.arm(now, me.timing.greeting_wait_s)  # a speaker is there, and will say it again
        repair.after_garble(me, over_own_speech, addressed, now)

    def channel(self, busy: bool, now: float) -> None:
        """Another speaker began (True) or stopped (False) speaking."""
        me = self.knowledge
        me.floor.channel(busy, now)
        me.current.objected |= busy and now < me.current.objected_s and not me.floor.is_second

    def mute(self, muted: bool) -> None:
        """The robot can say nothing (True), or can speak again (False)."""
        self.knowledge.floor.muted = muted

    def spoken(self, now: float, cut: bool = False) -> None:
        """The sentence of the last `Say` is out; `cut`: it was broken off, and nobody has understood it."""
        me, said = self.knowledge, self.knowledge.repair.last_said
        order = self._order_after(whose_turn(said) if said else me.role.name, now)
        me.floor.answer_slots = answer_slots(me, now)
        if (intent := me.floor.ended(now, order)) is not None:
            right_of_way.said(me, intent.topic, now)
            ahead.said(me, intent.topic, now)
            if (trigger := intent.trigger) is not None:  # a motion whose read-back was cut waits to be confirmed
                fire(me, Trigger.SPOKEN if cut and trigger is Trigger.SPOKEN_SURE else trigger, now)
        teaming.settle(me, now)
        if cut:
            self.garbled(True, now)

    def performed(self, now: float) -> None:
        """The actions of the last `Perform` are carried out."""
        me = self.knowledge
        if me.state is State.GOING:
            me.timer_s = me.current.objected_s
            if now >= me.timer_s:
                deadlines.time_is_over(me, now)
            return
        goes_on = me.state is State.ACTING and me.current.ahead_sure and len(me.my_tasks()) > 1
        fire(me, Trigger.PERFORMED_FIRST if goes_on else Trigger.PERFORMED, now)

    def perform_failed(self, now: float, reason: str | None = None) -> None:
        """The actions of the last `Perform` cannot be carried out; `reason`: why, if it can be said."""
        self.knowledge.report.reason = reason
        fire(self.knowledge, Trigger.FAILED, now)

    def remark(self, text: str, now: float) -> None:
        """Request the floor for a remark that a task asks for."""
        me = self.knowledge
        me.floor.say(Urgency.TURN, f"remark {text}", composing.to_all(me, m.Remark(text)), now)

    def say(self, utterance: m.Utterance, now: float) -> str | None:
        """Say a sentence for the robot's owner when its turn comes. Returns why it will not be said, or None."""
        return saying.request(self.knowledge, utterance, now)

    def sensed(self, here: Place | None = None, battery_v: float | None = None) -> None:
        """The robot's place and its battery's voltage; None: not known now. Its first place is its home."""
        body = self.knowledge.body
        body.here = here or body.here
        body.home = body.home or body.here
        body.battery_v = battery_v if battery_v is not None else body.battery_v

    def may_drive(self, way: Sequence[Place], now: float) -> bool:
        """Whether the robot may drive on, straight from one place of the `way` to the next, starting where it was last
        sensed. Call it throughout the drive: it asks the others for the places ahead, and gives back those behind."""
        return right_of_way.may_drive(self.knowledge, way, now)

    def timed(self, asker: str, ticks: int | None, now: float) -> None:
        """Tell a robot that asked how far this one is the interval (see `ranging`); None: it could not be measured."""
        ranging.tell(self.knowledge, asker, ticks, now)

    def stop(self, now: float) -> bool:
        """Halt and latch, as if "stop" had been heard, and say so aloud. Returns whether it was not stopped already."""
        halting.refuse_to_resume(self.knowledge, now)
        if not (before := self.knowledge.latched):
            fire(self.knowledge, Trigger.STOP, now)
        return not before

    def set_clock(self, offset_s: float | None, now: float) -> None:
        """Set the clock: seconds since 1970 at 0 of the sample clock; None if nobody knows the time."""
        me = self.knowledge
        if me.clock_s is None or offset_s is None or abs(offset_s - me.clock_s) > CLOCK_STEP_S:
            me.clock_s, me.due_next_s = offset_s, None
            schedule.open_due(me, now)

    def tell_memory_lost(self, now: float) -> None:
        """Say aloud that its memory is lost, so it began stopped; once released, it asks for the remaining tasks."""
        halting.tell_memory_lost(self.knowledge, now)

    def change(self, number: int, skip: bool, now: float) -> str | None:
        """Have a task done again, or left out this time, and tell the others. Returns why that cannot be, or None."""
        return changing.want(self.knowledge, number, skip, now)

    def resume(self, now: float) -> bool:
        """Take on tasks again, as if "resume" had been heard. Returns whether it was stopped."""
        before = self.knowledge.latched
        self.knowledge.latch(False)  # of who leaves, too
        fire(self.knowledge, Trigger.RESUME, now)
        return before

    def reconfigure(
        self, now: float, role: Role, tasks: Iterable[TaskDefinition] = (), forgiven: Iterable[int] = ()
    ) -> None:
        """Take another role, and other places, actions and times for some of the tasks, whose numbers and names stay.
        The robot may retry the tasks `forgiven`, although it gave them up."""
        self.knowledge.role, self.knowledge.due_next_s = role, None
        self.board.redefine(tasks)
        self.board.forgive(role.name, forgiven)
        self.peers.let_rest(self.board.recurs)
        effects.drive_anew(self.knowledge)
        self.knowledge.reconsider(now)

    def retask(self, tasks: Iterable[TaskDefinition], now: float, places: Iterable[SharedPlace] = ()) -> None:
        """Use these tasks and places, and no others, from now on; ask the other robots what they know of new tasks."""
        me = self.knowledge
        right_of_way.take_places(me, places, now)
        changing.replace_tasks(me, tasks, now)
        self.peers.let_rest(self.board.recurs)
        me.due_next_s, me.missed.heard_work = None, True
        schedule.open_due(me, now)
        effects.drive_anew(me)
        me.reconsider(now)

    def leave(self, now: float) -> None:
        """The robot is about to be switched off: it says so, and gives back its task."""
        fire(self.knowledge, Trigger.LEAVE, now)

    def tick(self, now: float) -> None:
        """Carry out everything that is due."""
        me = self.knowledge
        if now >= me.timer_s:
            me.timer_s = me.floor.unsettled_until(now)  # the answer may be in the air or in recognition
            if now >= me.timer_s:
                me.timer_s = math.inf
                deadlines.time_is_over(me, now)
        schedule.open_due(me, now)
        changing.spread(me, now)
        deadlines.renew_lease(me, now)
        right_of_way.ask(me, now)
        ahead.repeat(me, now)
        intent = me.floor.begin(now)
        if intent is not None:
            saying.begin(me, intent, now)

    def next_deadline(self) -> float:
        """When `tick` must be called at the latest; infinity if nothing is due."""
        me = self.knowledge
        due_s = (deadlines.renewal_s(me), schedule.next_s(me), changing.next_s(me), right_of_way.next_s(me))
        return min(me.floor.next_deadline(), me.timer_s, me.current.ahead_s, *due_s)

    def actions(self, now: float) -> tuple[Action, ...]:
        """The actions to carry out now, in order; each is returned once."""
        me = self.knowledge
        for number in dict.fromkeys(me.board.changed):
            me.board[number].since_s = now
            me.do(SaveTask(number, me.board[number].lasting_state, me.board[number].owner))
            if (due_s := schedule.note_done(me, number, now)) is not None:
                me.do(SaveDue(number, due_s))
            if me.board[number].is_changed:
                me.do(SaveChange(number, me.board[number].change, me.board[number].skipped))
        me.board.changed.clear()
        actions, me.actions = tuple(me.actions), []
        return actions

    @property
    def state(self) -> State:
        """The robot's state in the conversation."""
        return self.knowledge.state

    @property
    def task(self) -> int | None:
        """The task that it has claimed, reads back, carries out or has just ordered."""
        return self.knowledge.current.task

    @property
    def role(self) -> Role:
        """Its role in the team."""
        return self.knowledge.role

    @property
    def at_place(self) -> bool:
        """Whether the robot performs the task itself, not the way there."""
        return self.state is State.ACTING

    @property
    def has_left(self) -> bool:
        """Whether it has said that it leaves."""
        return self.state is State.GONE

    def _is_second(self, u: m.Utterance, believed: bool, now: float) -> bool:
        """Whether this repeats the sentence that was understood just before: the robot does not act on it again."""
        me = self.knowledge
        (last, was_believed, at_s), me.last_heard = me.last_heard, (u, believed, now)
        counts = believed and (isinstance(u.statement, COUNTS_TWICE) or not was_believed)  # its seal was misheard
        return last == u and not counts and -math.inf < me.floor.busy_since_s <= at_s + SAME_WITHIN_S

    def _order_after(self, speaker: str | None, now: float) -> Order | None:
        """This robot's position in the round of turns after a speaker; None for a newcomer that was given no names."""
        me = self.knowledge
        if speaker is None or (me.state in NEWCOMER and not me.role.roster):
            return None
        return round_of_turns(me.roster, me.peers.present(now), me.role.name.lower(), speaker.lower())
