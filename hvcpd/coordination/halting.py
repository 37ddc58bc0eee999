"""The effects of "stop", of "resume", and of the end of the program, which the transition table names."""

from __future__ import annotations

from hvcpd.coordination import composing, effects
from hvcpd.coordination.actions import BreakOff, Halt
from hvcpd.coordination.conversation import NEVER_S
from hvcpd.coordination.floor import OWN_TURN, RESUMES, Intent, Urgency
from hvcpd.coordination.knowledge import Current, Knowledge
from hvcpd.coordination.states import Trigger
from hvcpd.language import messages as m


def release(me: Knowledge, now: float) -> None:
    """Resume does not restart an old motion: the robot is free, and no longer says that it has stopped."""
    for topic in ("stopped", "released how", "again"):
        me.floor.withdraw(topic)
    me.repair.last_said = None
    me.latch(False)
    effects.rest(me, now)


def want_farewell(me: Knowledge, now: float) -> None:
    """Give the task back and say so; first repeat the reports that were not yet confirmed."""
    effects.give_tasks_back(me)
    effects.say_only_reports(me, Urgency.ALARM, now, _farewell_slot(me, now))
    me.current = Current()
    _want_to_say_farewell(me, now)


def _want_to_say_farewell(me: Knowledge, now: float, after_s: float = 0.0) -> None:
    farewell = composing.to_all(me, m.Leaving())
    slot, trigger = _farewell_slot(me, now), Trigger.SPOKEN_FAREWELL
    said = Intent(Urgency.ANSWER, OWN_TURN, lambda: farewell, trigger, slot, not_before_s=now + after_s)
    me.floor.want(said, now)


def _farewell_slot(me: Knowledge, now: float) -> int:
    """Before confirmations, in turn: one computer's robots are switched off at one moment. If two robots leave and no
    other is there, nobody remains to hear them."""
    return me.rank_with_unheard("", 0, now) if len(me.expected(now)) > 1 else 0


def stop_and_leave(me: Knowledge, now: float) -> None:
    """The robot is stopped, and leaves anyway; it will still be stopped when it is switched on again. First the "stop"
    travels on."""
    latch(me, now)
    me.repair.last_said = None
    _want_to_say_farewell(me, now, 2.0 * me.timing.stop_again_s)


def latch(me: Knowledge, _now: float) -> None:
    me.do(Halt())
    me.latch(True)


def call(me: Knowledge, topic: str, stop: m.Utterance, now: float) -> None:
    """Say "stop" at once, over any other speech, and unless it is for one robot again, for those that missed it; no
    longer if this robot stands now and is released meanwhile."""
    interrupt(me)
    withdraw_resumes(me)
    stands = me.latched
    times_s = (now,) if isinstance(stop.addressee, m.ToRobot) else (now, now + me.timing.stop_again_s)
    for number, at_s in enumerate(times_s):
        said = Intent(
            Urgency.ALARM,
            f"{topic} {number}",
            lambda: stop if me.latched or not stands else None,
            not_before_s=at_s,
            at_once=True,
        )
        me.floor.want(said, now)


def interrupt(me: Knowledge) -> None:
    """Something more urgent is to be said than this robot's present sentence, unless that is a "stop"."""
    speaking = me.floor.speaking
    if speaking is not None and not speaking.at_once:
        if speaking.trigger is Trigger.SPOKEN_FAREWELL:
            speaking.trigger = None  # it is said again
        me.do(BreakOff())


def fall_silent(me: Knowledge, _now: float) -> None:
    me.floor.clear()


def refuse_to_resume(me: Knowledge, said_s: float) -> None:
    """Every "stop" outdoes an earlier "resume", also where the robot stands already: one that was heard unsurely, one
    that is understood only later, and one that the robot was still to say for its owner."""
    me.repair.stop_s = max(me.repair.stop_s, said_s)
    me.repair.resume_s = NEVER_S  # "resume" is to be heard twice after it
    withdraw_resumes(me)


def withdraw_resumes(me: Knowledge) -> None:
    """Say no "resume" that the owner asked for before a "stop", whichever robot that was for."""
    me.floor.withdraw_all(RESUMES)


def halt(me: Knowledge, now: float) -> None:
    """Stop, and latch: tasks, turns and motions are forgotten, and only "resume" ends this state."""
    effects.give_tasks_back(me)
    me.latch(True)
    interrupt(me)
    effects.say_only_reports(me, Urgency.TURN, now)
    me.current = Current()
    place = next((each.place.name for each in me.places if each.inside), None)
    stopped = composing.to_all(me, m.Stopped() if place is None else m.PlaceTaken(place, stands=True))
    after_s = 2.0 * me.timing.stop_again_s  # "stop" first travels from one robot to the next
    _want_in_turn(me, Urgency.ALARM, "stopped", stopped, after_s, now)
    want_release_hint(me, now)


def want_release_hint(me: Knowledge, now: float) -> None:
    """Tell people who come by why the robot stands, and what to say; nothing else ends a stop."""
    released = composing.to_all(me, m.Stopped(waits=True))
    _want_in_turn(me, Urgency.TURN, "released how", released, me.timing.standing_s, now)


def _want_in_turn(
    me: Knowledge, urgency: Urgency, topic: str, utterance: m.Utterance, after_s: float, now: float
) -> None:
    """Say it `after_s` from now at the earliest, each robot in a slot of its own: one call has stopped all of them at
    one moment."""
    slot = me.rank("", 0, now)
    not_before_s = now + after_s + slot * me.timing.slot_s
    me.floor.want(Intent(urgency, topic, lambda: utterance, slot=slot, not_before_s=not_before_s), now)


def tell_memory_lost(me: Knowledge, now: float) -> None:
    """Say why the robot begins stopped; once released, it asks for the remaining tasks."""
    me.missed.any_work = me.missed.heard_work = True
    me.floor.say(Urgency.ALARM, "stopped", composing.to_all(me, m.Stopped(forgot=True)), now, slot=0)
