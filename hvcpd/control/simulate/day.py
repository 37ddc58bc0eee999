"""`hvcpctl simulate --hours`: hours or days of a team at the level of words, in minutes, and a report of the shift.

The robots' own conversation over simulated air that carries words without sound; driving and skills only take time.
"""

from __future__ import annotations

import argparse
import sys
from datetime import timedelta

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import WordMission, WordPlan
from hvcpd.config.recurrence import BEGIN
from hvcpd.control.output import print_note, show
from hvcpd.control.simulate.simulate_parser import FOR_SOUND
from hvcpd.control.simulate.team import Team, as_written, lacked_skills, unable_robots
from hvcpd.coordination.actions import Speech, Talk
from hvcpd.errors import EX_FAILURE, EX_OK, AudioFileError, ConfigError, writing
from hvcpd.language import messages as m
from hvcpd.memory.store import TranscriptRecord, TranscriptRow
from hvcpd.reporting.occurrences import occurrences
from hvcpd.reporting.shift import Shift, read_shift
from hvcpd.reporting.shift_page import as_json, as_text, write_shift
from hvcpd.security.trust import Trust

BEGIN_S = (BEGIN + timedelta(weeks=1)).timestamp()
"""Midnight before a Monday, local time: every such shift begins then, so that the same seed gives the same shift."""
HOUR_S = 3600.0


def run_hours(options: argparse.Namespace, team: Team, coordinator: str | None, speech: Speech) -> int:
    """Run it, show the shift, write its page; returns 0 only if everything due was done, and nothing twice."""
    useless = next((name for name, default in FOR_SOUND.items() if getattr(options, name) != default), None)
    if useless is not None:
        raise ConfigError(f"--hours simulates words, without sound; leave out --{useless.replace('_', '-')}")
    once = [task.number for task in team.tasks.tasks if task.every is None and not task.on_demand]
    if once:
        subject = f"task{'s' * (len(once) > 1)} {', '.join(map(str, once))}"
        print_note(f"note: {subject}: done only once, without `every:` (docs/skills.md)")
    if team.tasks.places:
        names = ", ".join(place.name for place in team.tasks.places)
        print_note(f"note: with --hours robots drive through {names} unasked; see it without --hours")
    plan = day_plan(options, team, coordinator, speech)
    if not plan.clocks and any(task.every is not None for task in plan.tasks):
        print_note("note: no robot here has a clock (clock: false), so none knows when a task is due")
    mission = WordMission(plan, keep=True)
    understood: list[m.Utterance] = []

    def note(listener: str, utterance: m.Utterance) -> tuple[m.Utterance, Trust]:
        if listener == options.robots[0]:
            understood.append(utterance)
        return utterance, Trust.OPEN

    mission.air.judge = note
    mission.remember_done(BEGIN_S)
    mission.run()
    shift = _shift(mission, understood, team, options.hours * HOUR_S)
    show(options.json, as_json(shift), *as_text(shift).splitlines())
    if options.report is not None:
        path = options.report / "shift.html"
        with writing(path, AudioFileError, "--report: ", "name another directory"):
            write_shift(shift, path)
        if not options.json:
            sys.stdout.write(f"\nReport: {path} (open it in a browser)\n")
    if not shift.due:
        print_note(f"note: within {options.hours:g} h of Monday, 00:00, nothing is due")
    good = all(each.became in ("done", "done late", "to be done") for each in shift.due)
    return EX_OK if good else EX_FAILURE


def day_plan(options: argparse.Namespace, team: Team, coordinator: str | None, speech: Speech) -> WordPlan:
    """The hours that the options, and the settings for their own robot, describe."""
    skills = frozenset(skill.name for skill in team.tasks.skills)
    lacked = lacked_skills(options.without, options.robots, skills, team)
    unable, own = unable_robots(team, options.robots), as_written(team.settings.name, options.robots)
    clocked = [name for name in options.robots if team.settings.clock or name != own]
    return WordPlan(
        options.robots,
        team.tasks.tasks,
        options.seed,
        Conditions(loss=options.loss),
        coordinator=coordinator,
        nearest_first=options.pick == "nearest",
        speech=speech,
        talks=dict.fromkeys(options.robots, Talk(options.talk)),
        unable={
            name: unable.get(name, frozenset()) | team.tasks.lacking(skills - lacked.get(name, frozenset()))
            for name in options.robots
        },
        clocks=dict.fromkeys(clocked, 0.0),
        begin_s=BEGIN_S,
        team=team.settings.team,
        limit_s=options.hours * HOUR_S,
    )


def _shift(mission: WordMission, understood: list[m.Utterance], team: Team, length_s: float) -> Shift:
    """The shift in the form of the first robot's transcript; of others' sentences it `understood` these."""
    own, begin_s, known = mission.plan.names[0], mission.plan.begin_s, set(map(id, understood))

    def record(at_s: float, speaker: str, u: m.Utterance) -> TranscriptRecord:
        if speaker == own:
            return TranscriptRecord(at_s, "said", speaker, team.phrasebook.write(u))
        if id(u) in known:
            return TranscriptRecord(at_s, "heard", speaker, team.phrasebook.write(u))
        return TranscriptRecord(at_s, "garbled", None, "")

    rows = [TranscriptRow(n, begin_s + said[0], record(*said)) for n, said in enumerate(mission.said, 1)]
    tasks, end_s = team.tasks.tasks, begin_s + length_s
    deeds = [(begin_s + at_s, number, by) for at_s, number, by in mission.done]
    due = occurrences(tasks, deeds, begin_s, end_s)
    return read_shift(rows, team.phrasebook, tasks, (begin_s, end_s), due)
