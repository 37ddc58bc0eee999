"""Runs whole missions by seed: whether every task was done exactly once, how much was said, and how fast they ran.

    python -m benchmarks.missions audio [--seeds 1-20] [--modes volunteer,coordinate] [--robots Rob,Bot]
        [--plants 5-12] [--noise-db 35-45]
    python -m benchmarks.missions relay [--seeds 1-3]
    python -m benchmarks.missions words [--seeds 1-10000] [--loss 0-0.3] [--outages 2]
        [--talk normal | --anything | --pairs]
    python -m benchmarks.missions earshot [--seeds 1-200]
    python -m benchmarks.missions corridor [--seeds 1-1000] [--loss 0-0.3] [--outages 2] [--inside 0]
    python -m benchmarks.missions days [--seeds 1-10000] [--hours 72] [--no-mishearing]
    python -m benchmarks.missions crowd [--seeds 1-5]
    python -m benchmarks.missions makespan [--seeds 1-20] [--tasks 24] [--work-s 5] [--pick nearest]
    python -m benchmarks.missions routes [--seeds 1-200] [--pick nearest]
    python -m benchmarks.missions questions [--seeds 1-100]
    python -m benchmarks.missions speed

`audio` runs `hvcpctl simulate --json` for each seed; the figures are those of its last line. With `--plants`, so many
stand at random places, in noise of a random level. `relay`: whole robots with sound, too; three in a row, an order from
one end to the other, which do not hear each other. `earshot`: both modes, where a voice carries some metres and many
plants are farther off. `corridor`: two rooms with a corridor between them that only one robot fits in. `makespan`: how
soon teams of growing size are done with the same tasks. `routes`: how far two to four robots drive for up to eight
tasks, against the best assignments. `questions`: what people can tell of a mission from its transcript alone.
The others run the same state machines over air of words (hil_fakes), with random teams, places, losses and outages.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from benchmarks import questions, routes
from benchmarks.corridor import corridor
from benchmarks.random_plants import random_room
from hil_fakes.bench import Bench
from hil_fakes.bench_plans import relay_plan
from hil_fakes.word_mission import WordMission, WordPlan
from hil_fakes.word_plans import (
    NAMES,
    any_plan,
    fading_plan,
    omniscient_airtime_s,
    ordered_pairs_plan,
    random_plan,
    random_tasks,
    recurring_plan,
    with_talk,
)
from hvcpd.assembly.sound import make_sound
from hvcpd.config.tasks import Tend
from hvcpd.coordination.actions import Talk
from hvcpd.evaluation.statistics import wilson
from hvcpd.language import messages as m
from hvcpd.reporting.events import Said, Summary

_Number = TypeVar("_Number", int, float)


def fly(seed: int, mode: str, robots: str, more: list[str]) -> tuple[int, dict[str, Any]]:
    """Run one mission with sound; its exit status and its summary."""
    command = [sys.executable, "-m", "hvcpd.control.cli", "simulate", "--json"]
    command += ["--seed", str(seed), "--mode", mode, "--robots", robots, *more]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if not done.stdout:
        raise SystemExit(done.stderr)
    return done.returncode, json.loads(done.stdout.splitlines()[-1])


def more_options(o: argparse.Namespace, seed: int) -> list[str]:
    """The plants and the noise of a seed's room, as options of `simulate`; none if they are to be the usual ones."""
    if o.plants is None:
        return []
    room = random_room(seed, _ends(o.plants, int), _ends(o.noise_db, float))
    file = Path(o.folder) / f"tasks-{seed}.yaml"
    room.write_tasks(file)
    return ["--tasks", str(file), "--noise-db", str(room.noise_db)]


def audio(o: argparse.Namespace) -> None:
    with tempfile.TemporaryDirectory() as o.folder:
        _audio(o)


def _audio(o: argparse.Namespace) -> None:
    print("mode        seed  ok  done  twice  lost  sent  understood  collisions  virtual s  wall s  times real time")
    for mode in o.modes.split(","):
        factors, good = [], 0
        for seed in _range(o.seeds):
            status, s = fly(seed, mode, o.robots, [*more_options(o, seed), *o.more])
            factors.append(s["realtime_factor"])
            good += status == 0
            counts = (len(s["done"]), s["duplicates"], s["lost"], s["utterances_sent"], s["utterances_understood"])
            ok = "yes" if status == 0 else "NO "
            print(
                f"{mode:10} {seed:5}  {ok:3}" + "{:4} {:6} {:5} {:5} {:11}".format(*counts),
                f"{s['collisions']:11} {s['virtual_s']:10.1f} {s['wall_s']:7.1f} {s['realtime_factor']:16.1f}",
                flush=True,
            )
        print(f"{mode}: {good} of {len(factors)} good, {min(factors):.1f} to {max(factors):.1f} times real time\n")


def relay(o: argparse.Namespace) -> None:
    print("seed  done  twice  sent  passed on  collisions  virtual s  wall s")
    sound = make_sound()
    for seed in _range(o.seeds):
        events = Bench(relay_plan(seed), sound).run().events
        passed_on = sum(isinstance(e, Said) and " says, " in e.text for e in events)
        (s,) = (e for e in events if isinstance(e, Summary))
        print(
            f"{seed:4} {len(s.done):5} {s.duplicates:6} {s.utterances_sent:5} {passed_on:10} {s.collisions:11}",
            f"{s.virtual_s:10.1f} {s.wall_s:7.1f}",
            flush=True,
        )


def words(o: argparse.Namespace) -> None:
    loss = _ends(o.loss, float)
    twice = twice_whole = lost = endless = tasks = sent = n = 0
    ended_s = 0.0
    began_s = time.perf_counter()
    for seed in _range(o.seeds):
        if o.anything:
            plan = any_plan(seed)
        elif o.pairs:
            plan = ordered_pairs_plan(seed, loss, o.outages)
        else:
            plan = with_talk(random_plan(seed, loss=loss, outages_max=o.outages), o.talk)
        result = WordMission(plan).run()
        n += 1
        tasks += len(plan.tasks)
        sent += result.sent
        lost += result.lost > 0
        twice += result.duplicates > 0
        bad = result.duplicates > 0 and not result.off_in_mid_task
        twice_whole += bad
        endless += math.isinf(result.ended_s)
        ended_s += 0.0 if math.isinf(result.ended_s) else result.ended_s
        if bad or result.lost or math.isinf(result.ended_s):
            print(
                f"  seed {seed}: lost {result.lost}, twice {result.duplicates}, ended {result.ended_s:.0f} s",
                flush=True,
            )
    wall_s = time.perf_counter() - began_s
    print(f"{n} missions, loss {o.loss}, up to {o.outages} outages: {tasks} tasks, {sent / tasks:.1f} sentences a task")
    print(f"missions with a task lost: {lost}; that did not end: {endless}; mean time to the end {ended_s / n:.0f} s")
    print(f"missions with a task done twice: {twice}, of them without a robot switched off in mid-task: {twice_whole}")
    print(f"{n / wall_s:.0f} missions a second")


def earshot(o: argparse.Namespace) -> None:
    """Robots out of each other's earshot: tasks lost, tasks done twice, and robots that never learn that all is
    done."""
    print("mode        missions  tasks  lost  twice  each once in  not all know  sentences a task")
    for mode in ("coordinate", "volunteer"):
        plans = [fading_plan(seed, mode == "coordinate") for seed in _range(o.seeds)]
        results = [WordMission(plan).run() for plan in plans]
        tasks = sum(len(plan.tasks) for plan in plans)
        lost, twice = (sum(getattr(r, what) for r in results) for what in ("lost", "duplicates"))
        once = sum(not r.lost and not r.duplicates for r in results)
        unaware = sum(math.isinf(r.ended_s) for r in results)
        said = sum(r.sent for r in results) / tasks
        print(f"{mode:10} {len(plans):9} {tasks:6} {lost:5} {twice:6} {once:13} {unaware:13} {said:17.1f}", flush=True)


def days(o: argparse.Namespace) -> None:
    """Recurring tasks: was each occurrence done, and once?"""
    n = whole = lost = twice = occurrences = sent = 0
    began_s = time.perf_counter()
    for seed in _range(o.seeds):
        plan = recurring_plan(seed, hours=o.hours)
        if o.no_mishearing:
            plan = replace(plan, conditions=replace(plan.conditions, mishearing=0.0))
        mission = WordMission(plan)
        result = mission.run()
        n += 1
        whole += not result.off_in_mid_task
        occurrences += len(mission.occurrences())
        sent += result.sent
        lost += result.missed > 0
        bad = result.repeated > 0 and not result.off_in_mid_task
        twice += bad
        if result.missed or result.repeated:
            crash = "; a robot was switched off in mid-task" if result.off_in_mid_task else ""
            print(f"  seed {seed}: lost {result.missed}, twice {result.repeated}{crash}", flush=True)
    wall_s = time.perf_counter() - began_s
    print(f"{n} missions of {o.hours:g} h: {occurrences} occurrences, {sent / occurrences:.1f} sentences each")
    print(f"missions with an occurrence lost: {lost}; share without, 95 %: {_share(n - lost, n)}")
    print(
        f"missions with one done twice, of {whole} without a crash in mid-task: {twice}; {_share(whole - twice, whole)}"
    )
    print(f"{n / wall_s:.2f} missions a second")


def _share(right: int, n: int) -> str:
    low, high = wilson(right, n)
    return f"{low:.4f} to {high:.4f}"


def crowd(o: argparse.Namespace) -> None:
    """The air that a team uses, against the number of robots, three tasks each, nothing lost."""
    print("robots tasks  ended s  sentences  collisions  airtime s  of an omniscient scheduler's  air busy")
    for n in (2, 4, 6, 8, 12, 16, 20):
        rows = [_crowd_mission(n, seed) for seed in _range(o.seeds)]
        ended, sent, collisions, air_s, ratio = (sum(row[i] for row in rows) / len(rows) for i in range(5))
        print(
            f"{n:6} {3 * n:5} {ended:8.0f} {sent:10.0f} {collisions:11.1f} {air_s:10.0f} {ratio:8.2f} "
            f"{'#' * round(10 * ratio):20} {air_s / ended:9.0%}",
            flush=True,
        )


def _crowd_mission(n: int, seed: int) -> tuple[float, ...]:
    plan = WordPlan(NAMES[:n], random_tasks(3 * n, random.Random(seed)), seed)
    result = WordMission(plan).run()
    if result.lost or result.duplicates or math.isinf(result.ended_s):
        print(f"  {n} robots, seed {seed}: {result}")
    air_s = result.airtime_s
    return result.ended_s, result.sent, result.collisions, air_s, air_s / omniscient_airtime_s(plan)


def makespan(o: argparse.Namespace) -> None:
    """The same tasks by teams of growing size: when the last is done, when all know it, and the first two claims."""
    print(f"{o.tasks} tasks of {o.work_s:g} s, {o.pick} first, seeds {o.seeds}: mean and worst")
    print("robots  last done s  all know it s  two claims s  sentences  air busy  lost  twice")
    for n in (1, 2, 4, 6, 8, 12):
        runs = [_timed_mission(n, seed, o) for seed in _range(o.seeds)]
        done, ended, claims, sent, busy, lost, twice = zip(*runs, strict=True)
        print(
            f"{n:6} {_mean(done):8.0f} {max(done):4.0f} {_mean(ended):9.0f} {max(ended):4.0f} {_mean(claims):13.1f}",
            f"{_mean(sent):10.0f} {_mean(busy):9.0%} {sum(lost):5} {sum(twice):6}",
            flush=True,
        )


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def _timed_mission(n: int, seed: int, o: argparse.Namespace) -> tuple[float, ...]:
    drawn = random_tasks(o.tasks, random.Random(seed))
    tasks = tuple(replace(t, actions=(*t.actions[:-1], Tend(o.work_s))) for t in drawn)
    mission = WordMission(WordPlan(NAMES[:n], tasks, seed, nearest_first=o.pick == "nearest"), keep=True)
    result = mission.run()
    claims = [at_s for at_s, _, u in mission.said if isinstance(m.own_words(u.statement), m.Claim)]
    last_s = max(at_s for at_s, _, _ in mission.done)
    busy = result.airtime_s / result.ended_s
    second_s = claims[1] if len(claims) > 1 else math.nan
    return last_s, result.ended_s, second_s, result.sent, busy, result.lost, result.duplicates


def speed(_: argparse.Namespace) -> None:
    for robots, tasks, seeds in ((2, 5, 1000), (4, 10, 200), (12, 40, 20)):
        plans = [random_plan(s, robots=(robots, robots), tasks=(tasks, tasks), outages_max=0) for s in range(seeds)]
        for title, loss in (("no loss", 0.0), ("loss 0-30 %", None)):
            began_s = time.process_time()  # of the processor: others may use it too
            for plan in plans:
                quiet = replace(plan, conditions=replace(plan.conditions, loss=0.0)) if loss == 0.0 else plan
                WordMission(quiet).run()
            rate = seeds / (time.process_time() - began_s)
            print(f"{robots:3} robots, {tasks:3} tasks, {title:12}: {rate:7.1f} missions a processor second")


def _range(text: str) -> range:
    first, last = _ends(text, int)
    return range(first, last + 1)


def _ends(text: str, kind: type[_Number]) -> tuple[_Number, _Number]:
    """The two ends of a range written "1-20", or twice the same number."""
    first, _, last = text.partition("-")
    return kind(first), kind(last or first)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(required=True)
    c = kinds.add_parser("audio")
    c.add_argument("--seeds", default="1-20")
    c.add_argument("--modes", default="volunteer,coordinate")
    c.add_argument("--robots", default="Rob,Bot")
    c.add_argument("--plants", help="so many at random places, as 5-12; the paper's five if it is not given")
    c.add_argument("--noise-db", default="35-45", help="with --plants: dB SPL, drawn for each mission")
    c.add_argument("more", nargs="*", help="further options of simulate, after --")
    c.set_defaults(run=audio)
    c = kinds.add_parser("relay")
    c.add_argument("--seeds", default="1-3")
    c.set_defaults(run=relay)
    c = kinds.add_parser("words")
    c.add_argument("--seeds", default="1-10000")
    c.add_argument("--loss", default="0-0.3")
    c.add_argument("--outages", type=int, default=2)
    c.add_argument("--anything", action="store_true", help="also skills, orders, tasks for two, talk, order of tasks")
    c.add_argument("--pairs", action="store_true", help="one robot gives orders, half of the tasks are for two")
    c.add_argument("--talk", choices=(*(talk.value for talk in Talk), "mixed"), default="normal")
    c.set_defaults(run=words)
    c = kinds.add_parser("earshot")
    c.add_argument("--seeds", default="1-200")
    c.set_defaults(run=earshot)
    c = kinds.add_parser("corridor")
    c.add_argument("--seeds", default="1-1000")
    c.add_argument("--loss", default="0-0.3")
    c.add_argument("--outages", type=int, default=2)
    c.add_argument("--inside", type=float, default=0.0, help="share of the tasks that lie in the corridor")
    c.set_defaults(run=corridor)
    c = kinds.add_parser("days")
    c.add_argument("--seeds", default="1-10000")
    c.add_argument("--hours", type=float, default=72.0)
    c.add_argument("--no-mishearing", action="store_true", help="lose sentences, but never mistake one for another")
    c.set_defaults(run=days)
    c = kinds.add_parser("crowd")
    c.add_argument("--seeds", default="1-5")
    c.set_defaults(run=crowd)
    c = kinds.add_parser("makespan")
    c.add_argument("--seeds", default="1-20")
    c.add_argument("--tasks", type=int, default=24)
    c.add_argument("--work-s", type=float, default=5.0)
    c.add_argument("--pick", choices=("nearest", "random"), default="nearest")
    c.set_defaults(run=makespan)
    c = kinds.add_parser("routes")
    c.add_argument("--seeds", default="1-200")
    c.add_argument("--pick", choices=("nearest", "random"), default="nearest")
    c.set_defaults(run=lambda o: routes.compare(_range(o.seeds), o.pick))
    c = kinds.add_parser("questions")
    c.add_argument("--seeds", default="1-100")
    c.set_defaults(run=lambda o: questions.answered(_range(o.seeds)))
    c = kinds.add_parser("speed")
    c.set_defaults(run=speed)
    o = parser.parse_args()
    o.run(o)


if __name__ == "__main__":
    main()
