"""One robot's part in the conversation: a state machine without I/O, after the manner of h11 and aioquic.

Whoever owns it calls `heard`, `channel`, `spoken`, `performed`, … with the time, and `tick` when `next_deadline`
is due; after each call `actions` hands out what is to be done. Times are seconds of the robot's sample clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

from hvcpd.config.tasks import Place, TaskDefinition
from hvcpd.coordination import choosing, claims, composing, effects, hearing, repair, strangers, trusting
from hvcpd.coordination.actions import Action, Chance, Role, SavePeer, SaveTask, Say, Timing
from hvcpd.coordination.addressing import whose_turn
from hvcpd.coordination.board import Board
from hvcpd.coordination.claims import HeardClaim, Quoted
from hvcpd.coordination.earshot import Waiting
from hvcpd.coordination.effects import OWN_TURN
from hvcpd.coordination.floor import RANK_MAX, Floor, Intent, Order, Urgency, round_of_turns
from hvcpd.coordination.peers import Peers, lot, team_of
from hvcpd.coordination.relaying import Relays
from hvcpd.coordination.strangers import Acquaintance
from hvcpd.coordination.table import AT_WORK, NEWCOMER, TRANSITIONS, State, Trigger
from hvcpd.language import messages as m
from hvcpd.security.trust import Trust

SAME_WITHIN_S = 1.0
"""The same sentence, begun no later than this after it was understood, is its second saying: SECOND_GAP_S, and some
more for ears that notice late. Nobody who waits for an answer says anything again so soon."""
CONFIRMERS = 3
"""So many confirmations may still begin before a new turn does; that three in a row have missed a claim is rare."""


class Coordination:
    """See the module. `remembered` are the tasks' states from the robot's store: number → (state, owner).

    `stopped`: it was stopped when it was switched off, and nobody has said "resume" since.
    """

    def __init__(
        self,
        role: Role,
        tasks: Iterable[TaskDefinition],
        chance: Chance,
        timing: Timing | None = None,
        remembered: Mapping[int, tuple[str, str | None]] | None = None,
        now: float = 0.0,
        stopped: bool = False,
    ) -> None:
        self.role = role
        self.timing = (timing or Timing()).for_speech(role.speech)
        self.chance = chance
        self.board = Board(tasks, remembered or {}, now + self.timing.lease_s)
        self._roster = frozenset(name.lower() for name in role.roster)
        self.peers = Peers(self.timing.absent_s)
        self.floor = Floor(self.timing, chance)
        self.repair = repair.Repair()
        self.state = State.STOPPED if stopped else State.WAKING
        self.task: int | None = None
        """The task that this robot has claimed, reads back or carries out, or has just ordered."""
        self.task_ref: m.TaskRef | None = None
        self.owner_before: str | None = None
        """Whose the task was before this robot claimed it."""
        self.doubted: tuple[str, int] | None = None
        """Who has said that this robot's own task, of that number, was done, and was not believed."""
        self.told_report = False
        """Whether the sentence that waits for a confirmation held the report that is due."""
        self.unreported: int | None = None
        """A task that this robot has finished or given up, and nobody has confirmed to have heard so."""
        self.motion: m.Motion | None = None
        """What it was told to do with its wheels, apart from tasks."""
        self.motion_sure = False
        self.partner: str | None = None
        """Who ordered, or is being ordered."""
        self.repeats = 0
        self.greetings = 0
        self.heard_work = bool(remembered)
        """Something was missed, before the first word or while switched off: worth to ask what is left."""
        self.here: Place | None = None
        """Where the robot believes to be, for the nearest task first."""
        self.home: Place | None = None
        """Where it was when it first knew: where "come back" leads."""
        self.battery_v: float | None = None  # as it was measured last
        self.assured_s = -math.inf
        """Until when somebody who confirmed it keeps this robot's claim."""
        self.claimed_s = -math.inf
        """When this robot last spoke of its task."""
        self.asked_since_s = -math.inf
        """When the sentence that waits for a confirmation was first said."""
        self.ask_again_s = -math.inf
        """Not before then it is asked again what is left."""
        self.missed_s = -math.inf
        """When it last turned out that this robot, or who it spoke to, had missed something."""
        self.heard_claim: HeardClaim | None = None
        self.quoted: Quoted | None = None
        """The last report that somebody told of in another one's name."""
        self.name_heard_s: tuple[float, ...] = ()
        """When another voice used this robot's name."""
        self.acquaintance = Acquaintance()
        self.waiting = Waiting()
        self.relays = Relays()
        self.doubts = trusting.Doubts()
        self._last_heard: tuple[m.Utterance, float] | None = None
        self._timer_s: float | None = None
        self._actions: list[Action] = []
        if not stopped:
            self.arm(now, self.timing.wake_min_s + chance.random() * self.timing.wake_spread_s)

    # --- what its owner tells it -------------------------------------------------------------------------------

    def heard(
        self,
        utterance: m.Utterance,
        now: float,
        confidence: float = 1.0,
        snr_db: float | None = None,
        trust: Trust = Trust.OPEN,
    ) -> None:
        """A sentence was understood, with a confidence of 0 to 1; `trust`: its seal's. The own name is never obeyed."""
        if utterance.speaker is not None and utterance.speaker.lower() == self.role.name.lower():
            if trust.proves_speaker:  # or else somebody without the key, or a recording of this robot
                hearing.hear_own_name(self, now)
            return
        believed = trusting.admit(self, utterance, trust)
        if utterance.speaker is not None and believed:
            peer = self.peers.heard(utterance.speaker, team_of(utterance), now, confidence, snr_db)
            self._actions.append(SavePeer(peer.name, peer.team, now))
        self.floor.answer_slots = claims.confirming_slot(self, now) + CONFIRMERS
        self.floor.understood(now, self._order_after(whose_turn(utterance), now))
        if self._is_second(utterance, now):
            return
        if not believed:
            trusting.refuse(self, utterance, trust, now)
            return
        hearing.react(self, utterance, 1.0 if trust.checks_words else confidence, now)
        if self.state is State.READY and self._timer_s is None and not self.board.all_done:
            self.arm(now, self.timing.decide_s)
        self._save_changes()

    def _is_second(self, u: m.Utterance, now: float) -> bool:
        """Whether this is the sentence that was understood just before, said once more: it is not acted on again."""
        last, self._last_heard = self._last_heard, (u, now)
        if last is None or not -math.inf < self.floor.busy_since_s <= last[1] + SAME_WITHIN_S:
            return False
        return last[0] == u

    def garbled(self, over_own_speech: bool, now: float) -> None:
        """Speech was noticed that could not be understood; over the own speech it tells that nobody heard us."""
        self.floor.hold_back(now)
        self.floor.garbled()
        if self.floor.is_second or now < self.repair.foreign_until_s:
            return  # what it was is known
        if self.state is State.MEETING:
            self.arm(now, self.timing.greeting_wait_s)  # somebody is there, who will say it again
        repair.after_garble(self, over_own_speech, now)
        if not over_own_speech:
            strangers.after_garble(self, now)

    def channel(self, busy: bool, now: float) -> None:
        """Somebody else began (True) or ended (False) to speak."""
        self.floor.channel(busy, now)

    def spoken(self, now: float) -> None:
        """The sentence of the last `Say` is out."""
        said = self.repair.last_said
        intent = self.floor.ended(now, self._order_after(whose_turn(said) if said else self.role.name, now))
        if intent is not None and intent.trigger is not None:
            self.fire(intent.trigger, now)

    def performed(self, now: float) -> None:
        """The actions of the last `Perform` are carried out."""
        if self.state is State.GOING:
            self.fire(Trigger.ARRIVED_SURE if choosing.is_assured(self, now) else Trigger.ARRIVED, now)
        else:
            self.fire(Trigger.PERFORMED, now)
        self._save_changes()

    def perform_failed(self, now: float) -> None:
        """The actions of the last `Perform` cannot be carried out."""
        self.fire(Trigger.FAILED, now)
        self._save_changes()

    def remark(self, text: str, now: float) -> None:
        """Want to make a remark that a task asks for."""
        self.want(Urgency.TURN, f"remark {text}", lambda: composing.to_all(self, m.Remark(text)), now)

    def leave(self, now: float) -> None:
        """The robot is about to be switched off: it says so, and gives back its task."""
        self.fire(Trigger.LEAVE, now)
        self._save_changes()

    @property
    def has_left(self) -> bool:
        """Whether it has said that it leaves."""
        return self.state is State.GONE

    def tick(self, now: float) -> None:
        """Do what is due."""
        if self._timer_s is not None and now >= self._timer_s:
            unsettled_s = self.floor.unsettled_until(now)
            if now < unsettled_s:
                self._timer_s = unsettled_s  # what is waited for may be being said, or recognised, right now
            else:
                self._timer_s = None
                choosing.time_is_over(self, now)
        self._renew(now)
        intent = self.floor.begin(now)
        if intent is not None:
            self._begin(intent, now)
        self._save_changes()

    @property
    def at_place(self) -> bool:
        """Whether what is being performed is the task itself, not the way there."""
        return self.state is State.ACTING

    def next_deadline(self) -> float:
        """When `tick` must be called at the latest; infinity if nothing is due."""
        deadline_s = min(self.floor.next_deadline(), self._renewal_s())
        return deadline_s if self._timer_s is None else min(deadline_s, self._timer_s)

    def actions(self) -> tuple[Action, ...]:
        """What is to be done now, in order; handed out once."""
        actions, self._actions = tuple(self._actions), []
        return actions

    # --- the machine -------------------------------------------------------------------------------------------

    def fire(self, trigger: Trigger, now: float) -> None:
        """Move along the table; a trigger without a row changes nothing."""
        row = TRANSITIONS.get((self.state, trigger))
        if row is None:
            return
        self.state, effect = row
        self._timer_s = None
        self.floor.withdraw(OWN_TURN)
        getattr(effects, effect)(self, now)

    def want(
        self,
        urgency: Urgency,
        topic: str,
        compose: Callable[[], m.Utterance | None],
        now: float,
        *,
        trigger: Trigger | None = None,
        slot: int | None = None,
        call: str | None = None,
        slowly: bool = False,
        tentative: bool = False,
        after_s: float = 0.0,
    ) -> None:
        """Want the floor for a sentence, not before `after_s`; see `Intent`."""
        self.floor.want(Intent(urgency, topic, compose, trigger, slot, call, slowly, tentative, now + after_s), now)

    def rank(self, asker: str, salt: int, now: float) -> int:
        """This robot's place among those who could answer `asker`, in an order that `salt` shuffles.

        Each name has a number of its own, so that who knows of one peer fewer still agrees with the others on the
        order of all the rest: the first two answer in one slot only if the second does not know of the first.
        """
        own, asking = self.role.name.lower(), asker.lower()
        own_lot = lot(own, salt)
        return min(sum(lot(name, salt) < own_lot for name in self.peers.present(now) if name != asking), RANK_MAX)

    def _order_after(self, speaker: str | None, now: float) -> Order | None:
        """This robot's place in the round of turns that begins after a speaker; a newcomer knows of one only if it was
        told the names."""
        if speaker is None or (self.state in NEWCOMER and not self.role.roster):
            return None
        return round_of_turns(self._roster, self.peers.present(now), self.role.name.lower(), speaker.lower())

    def reconsider(self, now: float) -> None:
        """Something became free."""
        if self.state is State.READY:
            self.arm(now, self.timing.decide_s)

    def lease_end_s(self, now: float) -> float:
        """When a lease that is renewed now ends: in a crowd each one's turn comes more rarely."""
        return now + max(self.timing.lease_s, self.timing.lease_per_robot_s * len(self.peers.present(now)))

    def arm(self, now: float, after_s: float) -> None:
        """The state's time is over then."""
        self._timer_s = now + after_s

    def arm_until(self, time_s: float | None) -> None:
        self._timer_s = time_s

    def postpone(self, by_s: float) -> None:
        """Give the state more time, if it has an end at all."""
        if self._timer_s is not None:
            self._timer_s += by_s

    def do(self, action: Action) -> None:
        """Hand an action out with the next `actions`."""
        self._actions.append(action)

    def my_task(self) -> int:
        if self.task is None:
            raise RuntimeError(f"no task in state {self.state}")
        return self.task

    def _begin(self, intent: Intent, now: float) -> None:
        utterance = intent.compose()
        if utterance is None:
            self.floor.ended(now)
            if intent.trigger is not None:
                self.fire(Trigger.WITHDRAWN, now)
            return
        statement = utterance.statement
        if isinstance(statement, m.Claim | m.Working):
            self.claimed_s = now
            self.told_report = False
        elif isinstance(statement, m.Completed | m.Failed) and statement.task.number == self.unreported:
            self.told_report = True
        if isinstance(statement, m.Relayed) and isinstance(utterance.addressee, m.ToRobot):
            self.relays.note(utterance.addressee.name, statement, now)
        if isinstance(statement, m.Spelled):
            self.acquaintance.spelled_s = now
        if isinstance(statement, m.Completed) and statement.next is not None:
            self.claimed_s = now
            intent.trigger = Trigger.SPOKEN_BOTH if intent.trigger and self.state is State.REPORTING else intent.trigger
        self.repair.last_said = utterance
        self._last_heard = None
        speech = self.role.speech
        self._actions.append(Say(utterance, intent.slowly or self.repair.slow or speech.slowly, speech.times))

    def _renewal_s(self) -> float:
        if (self.state is not State.GOING and self.state is not State.ACTING) or not self.peers.all():
            return math.inf
        return self.claimed_s + self.timing.renewal_s

    def _renew(self, now: float) -> None:
        if now >= self._renewal_s():
            self.claimed_s = now
            self.board.claim(self.my_task(), self.role.name, self.lease_end_s(now))
            self.want(Urgency.TURN, "renewal", lambda: composing.renewal(self), now)

    def _save_changes(self) -> None:
        changed = self.board.changed
        if changed:
            for number in changed:
                entry = self.board[number]
                self._actions.append(SaveTask(number, entry.lasting_state, entry.owner))
            changed.clear()

    @property
    def at_work(self) -> bool:
        return self.state in AT_WORK
