"""One robot's part in the conversation: a state machine without I/O, after the manner of h11 and aioquic.

Whoever owns it calls `heard`, `channel`, `spoken`, `performed`, … with the time, and `tick` when `next_deadline`
is due; after each call `actions` hands out what is to be done. Times are seconds of the robot's sample clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

from hvcpd.config.tasks import Action as TaskAction
from hvcpd.config.tasks import Forward, GoTo, Place, TaskDefinition, Turn
from hvcpd.coordination import hearing
from hvcpd.coordination.actions import Action, Chance, Halt, Perform, Role, SavePeer, SaveTask, Say, Timing
from hvcpd.coordination.board import CLAIMED, DONE, Board
from hvcpd.coordination.floor import Floor, Intent, Urgency
from hvcpd.coordination.peers import Peer, Peers
from hvcpd.coordination.table import TRANSITIONS, State, Trigger
from hvcpd.language import messages as m

OWN_TURN = "own turn"
"""The topic of what the state machine itself wants to say; answers to others have topics of their own."""

REPEATING_ANYWAY = frozenset({State.READ_BACK, State.ORDERED, State.REPORTED})
"""Who waits for an answer says the sentence again when none comes."""


class Coordination:
    """See the module. `remembered` are the tasks' states from the robot's store: number → (state, owner)."""

    def __init__(
        self,
        role: Role,
        tasks: Iterable[TaskDefinition],
        chance: Chance,
        timing: Timing | None = None,
        remembered: Mapping[int, tuple[str, str | None]] | None = None,
        now: float = 0.0,
    ) -> None:
        self.role = role
        self.timing = timing or Timing()
        self.chance = chance
        self.board = Board(tasks, remembered or {}, now + self.timing.lease_s)
        self.peers = Peers()
        self.floor = Floor(self.timing, chance)
        self.state = State.WAKING
        self.task: int | None = None
        """The task that this robot has claimed, reads back or carries out, or has just ordered."""
        self.task_ref: m.TaskRef | None = None
        self.partner: str | None = None
        """Who ordered, or is being ordered."""
        self.repeats = 0
        self.greetings = 0
        self.here: Place | None = None
        """Where the robot believes to be, for the nearest task first."""
        self._spoke_of_task_s = -math.inf
        self._last_said: m.Utterance | None = None
        self._timer_s: float | None = None
        self._actions: list[Action] = []
        self._arm(now, self.timing.wake_min_s + chance.random() * self.timing.wake_spread_s)

    # --- what its owner tells it -------------------------------------------------------------------------------

    def heard(self, utterance: m.Utterance, now: float) -> None:
        """A sentence was understood. The own name as speaker is an echo or an impostor: never obeyed."""
        if utterance.speaker is not None and utterance.speaker.lower() == self.role.name.lower():
            return
        self.floor.hold_back(now)
        if utterance.speaker is not None:
            peer = self.peers.heard(utterance.speaker, utterance.team, now)
            self._actions.append(SavePeer(peer.name, peer.team, now))
        hearing.react(self, utterance, now)
        self._save_changes()

    def garbled(self, over_own_speech: bool, now: float) -> None:
        """Speech was noticed that could not be understood; over the own speech it tells that nobody heard us."""
        self.floor.hold_back(now)
        last, self._last_said = self._last_said, None
        if not over_own_speech or last is None or self.state in REPEATING_ANYWAY:
            return
        self.answer("again", lambda: last, now)
        if self._timer_s is not None:
            self._timer_s += self.timing.answer_s

    def channel(self, busy: bool, now: float) -> None:
        """Somebody else began (True) or ended (False) to speak."""
        self.floor.channel(busy, now)

    def spoken(self, now: float) -> None:
        """The sentence of the last `Say` is out."""
        intent = self.floor.ended(now)
        if intent is not None and intent.trigger is not None:
            self.fire(intent.trigger, now)

    def performed(self, now: float) -> None:
        """The actions of the last `Perform` are carried out."""
        if self.state is State.GOING:
            sure = self.partner is not None or not self.peers.all()
            self.fire(Trigger.ARRIVED_SURE if sure else Trigger.ARRIVED, now)
        else:
            self.fire(Trigger.PERFORMED, now)
        self._save_changes()

    def perform_failed(self, now: float) -> None:
        """The actions of the last `Perform` cannot be carried out."""
        self.fire(Trigger.FAILED, now)
        self._save_changes()

    def tick(self, now: float) -> None:
        """Do what is due."""
        if self._timer_s is not None and now >= self._timer_s:
            unsettled_s = self.floor.unsettled_until(now)
            if now < unsettled_s:
                self._timer_s = unsettled_s  # what is waited for may be being said, or recognised, right now
            else:
                self._timer_s = None
                self._time_is_over(now)
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
        floor_s = self.floor.next_deadline()
        times = [t for t in (self._timer_s, floor_s, self._renewal_s()) if t is not None]
        return min(times, default=math.inf)

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
        getattr(self, effect)(now)

    def answer(self, topic: str, compose: Callable[[], m.Utterance | None], now: float) -> None:
        """Want to say something that does not move the machine."""
        self.floor.want(Intent(Urgency.ANSWER, topic, compose), now)

    def greet_back(self, name: str, now: float) -> None:
        """Answer a greeting; a robot that has not greeted yet is known by its answer."""
        waking = self.state in (State.WAKING, State.GREETING)
        trigger = Trigger.GREETED if waking else None
        compose = lambda: self.introduction(m.ToRobot(name))  # noqa: E731
        self.floor.want(Intent(Urgency.ANSWER, f"greet {name}", compose, trigger), now)

    def remark(self, text: str, now: float) -> None:
        """Want to make a remark that a task asks for."""
        self.floor.want(Intent(Urgency.TURN, f"remark {text}", lambda: self.utterance(m.ToAll(), m.Remark(text))), now)

    def say_again(self, now: float) -> None:
        """Somebody did not understand: the last sentence is said once more."""
        last = self._last_said
        if last is not None and self.state not in REPEATING_ANYWAY:
            self.answer("again", lambda: last, now)

    def reconsider(self, now: float) -> None:
        """Something became free."""
        if self.state is State.READY:
            self._arm(now, self.timing.decide_s)

    def utterance(self, to: m.Addressee | None, statement: m.Statement | None) -> m.Utterance:
        return m.Utterance(self.role.name, to, None, statement)

    def introduction(self, to: m.Addressee) -> m.Utterance:
        return m.Utterance(self.role.name, to, self.role.team, None)

    def lease_end_s(self, now: float) -> float:
        return now + self.timing.lease_s

    def _want(self, urgency: Urgency, compose: Callable[[], m.Utterance | None], now: float) -> None:
        self.floor.want(Intent(urgency, OWN_TURN, compose, Trigger.SPOKEN), now)

    def _begin(self, intent: Intent, now: float) -> None:
        utterance = intent.compose()
        if utterance is None:
            self.floor.ended(now)
            if intent.trigger is not None:
                self.fire(Trigger.WITHDRAWN, now)
            return
        if isinstance(utterance.statement, m.Claim | m.Working):
            self._spoke_of_task_s = now
        self._last_said = utterance
        self._actions.append(Say(utterance))

    def _arm(self, now: float, after_s: float) -> None:
        self._timer_s = now + after_s

    def _time_is_over(self, now: float) -> None:
        match self.state:
            case State.READY:
                self._choose(now)
            case State.MEETING if not self.peers.all() and self.greetings < self.timing.greetings_max:
                self.fire(Trigger.GAVE_UP, now)
            case State.READ_BACK | State.ORDERED | State.REPORTED:
                self.repeats += 1
                over = self.repeats >= self.timing.repeats_max
                self.fire(Trigger.GAVE_UP if over else Trigger.TIMEOUT, now)
            case _:
                self.fire(Trigger.TIMEOUT, now)

    def _choose(self, now: float) -> None:
        if self.role.coordinator:
            if self._next_order(now) is not None:
                self.repeats = 0
                self.fire(Trigger.CHOSE_ORDER, now)
                return
        elif self.role.volunteer and self.board.free_for(self.role.name, now):
            self.fire(Trigger.CHOSE_CLAIM, now)
            return
        waits = [self.board.next_lapse(now), *(p.silent_until_s for p in self.peers.all() if p.silent_until_s > now)]
        later = [t for t in waits if t is not None]
        self._timer_s = min(later, default=None)

    def _renewal_s(self) -> float | None:
        if self.state not in (State.GOING, State.ACTING) or not self.peers.all():
            return None
        return self._spoke_of_task_s + self.timing.renewal_s

    def _renew(self, now: float) -> None:
        due_s = self._renewal_s()
        if due_s is not None and now >= due_s:
            self._spoke_of_task_s = now
            self.board.claim(self._my_task(), self.role.name, self.lease_end_s(now))
            self.floor.want(Intent(Urgency.TURN, "renewal", self._compose_working), now)

    def _save_changes(self) -> None:
        for number in self.board.changed:
            entry = self.board[number]
            self._actions.append(SaveTask(number, entry.state, entry.owner))
        self.board.changed.clear()

    def _my_task(self) -> int:
        if self.task is None:
            raise RuntimeError(f"no task in state {self.state}")
        return self.task

    # --- effects named in the table ----------------------------------------------------------------------------

    def rest(self, now: float) -> None:
        self.task = self.task_ref = self.partner = None
        self._arm(now, self.timing.decide_s)

    def want_greeting(self, now: float) -> None:
        self.greetings += 1
        self._want(Urgency.TURN, lambda: self.introduction(m.ToAll()), now)

    def wait_for_answers(self, now: float) -> None:
        self._arm(now, self.timing.greeting_wait_s)

    def wait_for_answer(self, now: float) -> None:
        self._arm(now, self.timing.answer_s)

    def want_claim(self, now: float) -> None:
        self._want(Urgency.TURN, lambda: self._compose_claim(now), now)

    def _compose_claim(self, now: float) -> m.Utterance | None:
        free = self.board.free_for(self.role.name, now)
        if not free:
            return None
        task = self._nearest(free) if self.role.nearest_first else self.chance.choice(free)
        self.task = task.number
        self.board.claim(task.number, self.role.name, self.lease_end_s(now))
        to = m.ToTeam(self.role.team) if self.role.team else m.ToAll()
        return self.utterance(to, m.Claim(m.TaskByNumber(task.number)))

    def _nearest(self, tasks: tuple[TaskDefinition, ...]) -> TaskDefinition:
        here = self.here or Place(0.0, 0.0)

        def distance_m(task: TaskDefinition) -> float:
            place = task.place or here
            return math.hypot(place.x_m - here.x_m, place.y_m - here.y_m)

        return min(tasks, key=distance_m)

    def listen_for_objections(self, now: float) -> None:
        self._arm(now, self.timing.objection_s)

    def go(self, now: float) -> None:
        self.board.claim(self._my_task(), self.role.name, self.lease_end_s(now))
        self._spoke_of_task_s = now
        self._actions.append(Perform(self._my_task(), self._split()[0]))

    def act(self, _now: float) -> None:
        self._actions.append(Perform(self._my_task(), self._split()[1]))

    def _split(self) -> tuple[tuple[TaskAction, ...], tuple[TaskAction, ...]]:
        """The task's way there, and what is done there."""
        actions = self.board[self._my_task()].definition.actions
        n = next((i for i, a in enumerate(actions) if not isinstance(a, GoTo | Forward | Turn)), len(actions))
        return actions[:n], actions[n:]

    def want_announcement(self, now: float) -> None:
        self._want(Urgency.TURN, self._compose_working, now)

    def _compose_working(self) -> m.Utterance | None:
        if self.task is None:
            return None
        name = self.board[self.task].definition.name
        return self.utterance(m.ToAll(), m.Working(m.TaskByName(" ".join(name.lower().split()))))

    def finish_task(self, now: float) -> None:
        self.board.complete(self._my_task(), self.role.name)
        self.repeats = 0
        self.want_report(now)

    def give_task_up(self, now: float) -> None:
        self._actions.append(Halt())
        self.board.give_up(self._my_task(), self.role.name)
        self.repeats = 0
        self.want_report(now)

    def want_report(self, now: float) -> None:
        self._want(Urgency.TURN, self._compose_report, now)

    def _compose_report(self) -> m.Utterance | None:
        number = m.TaskByNumber(self._my_task())
        to = m.ToRobot(self.partner) if self.partner else m.ToAll()
        done = self.board[number.number].state == DONE
        return self.utterance(to, m.Completed(number) if done else m.Failed(number))

    def drop_task(self, now: float) -> None:
        self._actions.append(Halt())
        entry = self.board[self._my_task()]
        if entry.owner == self.role.name:
            self.board.release(entry.definition.number)
        self.rest(now)

    def want_read_back(self, now: float) -> None:
        self._want(Urgency.ANSWER, self._compose_read_back, now)

    def _compose_read_back(self) -> m.Utterance | None:
        if self.partner is None or self.task_ref is None:
            return None
        return self.utterance(m.ToRobot(self.partner), m.Claim(self.task_ref))

    def _next_order(self, now: float) -> tuple[str, TaskDefinition] | None:
        for peer in sorted(self.peers.all(), key=lambda p: p.name):
            if not self._is_at_work(peer, now) and peer.silent_until_s <= now:
                free = [t for t in self.board.free_for(peer.name, now) if t.number not in peer.unable]
                if free:
                    return peer.name, self.chance.choice(free)
        return None

    def _is_at_work(self, peer: Peer, now: float) -> bool:
        """Whether a robot has an order that it can still be carrying out, as far as we know."""
        if peer.assigned is None:
            return False
        entry = self.board[peer.assigned]
        return entry.state == CLAIMED and entry.owner == peer.name and now < entry.lease_end_s

    def want_order(self, now: float) -> None:
        self._want(Urgency.TURN, lambda: self._compose_order(now), now)

    def want_order_again(self, now: float) -> None:
        self._want(Urgency.TURN, self._compose_same_order, now)

    def _compose_order(self, now: float) -> m.Utterance | None:
        order = self._next_order(now)
        if order is None:
            return None
        self.partner, task = order
        self.task = task.number
        self.task_ref = m.TaskByName(" ".join(task.name.lower().split()))
        return self._compose_same_order()

    def _compose_same_order(self) -> m.Utterance | None:
        if self.partner is None or self.task_ref is None:
            return None
        return self.utterance(m.ToRobot(self.partner), m.Order(self.task_ref))

    def want_confirmation(self, now: float) -> None:
        if self.partner is not None:
            self.board.claim(self._my_task(), self.partner, self.lease_end_s(now))
            self.peers.update(self.partner, assigned=self._my_task())
        self._want(Urgency.ANSWER, lambda: self._compose_to_partner(m.Confirmed()), now)

    def want_denial(self, now: float) -> None:
        self._want(Urgency.ANSWER, lambda: self._compose_to_partner(m.Negative()), now)

    def _compose_to_partner(self, statement: m.Statement) -> m.Utterance | None:
        return self.utterance(m.ToRobot(self.partner), statement) if self.partner else None

    def note_refusal(self, now: float) -> None:
        peer = self.peers.get(self.partner) if self.partner else None
        if peer is not None:
            self.peers.update(peer.name, unable=peer.unable | {self._my_task()})
        self.rest(now)

    def note_silence(self, now: float) -> None:
        if self.partner is not None:
            self.peers.update(self.partner, silent_until_s=now + self.timing.silent_peer_s)
        self.rest(now)

    def halt(self, now: float) -> None:
        self._actions.append(Halt())
        self.floor.clear()
        if self.task is not None and self.board[self.task].owner == self.role.name:
            self.board.release(self.task)
        self.task = self.task_ref = self.partner = None
        self.answer("stopped", lambda: self.utterance(m.ToAll(), m.Stopped()), now)
