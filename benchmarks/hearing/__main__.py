"""Recognition of robots by robots, compared with PocketSphinx: counts right, wrong, garbled, missed and inserted
sentences.

Random sentences of the phrasebook, each in its speaker's voice, at unknown times in one stream of sound; the recogniser
is given only the names. PocketSphinx gets the same sentences with the same grammar, but also the place of each
one; where it gets none right, it is not tested farther away or in more of the same noise. SNRs are of the speech's
mean power to the noise's, both over 0 to 8 kHz. The table is printed line by line; with --out it is written as CSV too,
beside what earlier runs have left there, and plots are drawn (matplotlib: the `eval` extra).

    python -m benchmarks.hearing [--rows noise,range,rooms,...] [--sentences 50] [--names Mia,Ted,Gus,Rex] [--seed 7]
        [--noise white,pink] [--snr 20,0,-5] [--natural] [--accent gb] [--for-noise]
        [--level DBFS] [--data DIR] [--out DIR] [--no-peer] [--wrong]

The row `worlds`, which `all` leaves out, is of loudspeakers, rooms, clocks, motion and noises as they are met, each
sentence heard by the fresh ears of a whole robot, which looks twice: alone (`first`), or after two others of the same
robot in the same world (`acquainted`). With --data DIR, also by measured rooms and in recorded noises.

    python -m benchmarks.hearing --rows worlds [--conditions small-living,chapel,drawn,...] [--modes first,acquainted]
        [--sentences 50] [--names Mia,Ted,Gus,Rex] [--seed 7] [--data DIR] [--jobs 1] [--no-peer] [--wrong]

The row `sounds`, likewise, is of sounds that are no speech, recorded (--data DIR) and made: sentences, stops an hour.

    python -m benchmarks.hearing --rows sounds [--minutes 60] [--seed 7] [--data DIR] [--wrong]

The row `robot` is what the ears of a whole robot cost, in noise alone and while robots speak.

    python -m benchmarks.hearing --rows robot [--minutes 1] [--seed 7] [--data DIR]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmarks.hearing import cost
from benchmarks.hearing.conditions import Options, Stage
from benchmarks.hearing.distance import ranges
from benchmarks.hearing.listeners import Peer, make_peer, ours
from benchmarks.hearing.material import make_team
from benchmarks.hearing.noises import KINDS
from benchmarks.hearing.table import HEADING, PEER_HEADING, Result, joined, line, read_csv, result, totals, write_csv
from benchmarks.hearing.worlds import run as worlds
from benchmarks.hearing.worlds import sounds
from benchmarks.hearing.worlds.run import MODES
from benchmarks.manner import add_manner, manner_of
from hil_fakes import reverberation

SCORED = ("noise", "slow", "level", "channel", "clock", "rate", "steps", "range", "rooms")
ROBOTS = ("worlds", "sounds", "robot")
COSTS = ("cost", "vocabulary", "names")
HELD_OUT = "Mia,Ted,Gus,Rex"
"""Their voices (cedar, willow, oak, granite) are none of those that thresholds were fitted with."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.hearing", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", default="all", help=f"of {','.join((*SCORED, *COSTS, *ROBOTS))} (default: all)")
    parser.add_argument("--sentences", type=int, default=50, help="in each condition (default 50)")
    parser.add_argument("--names", default=HELD_OUT, help=f"of the robots (default {HELD_OUT})")
    add_manner(parser)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--noise", default=",".join(KINDS), help="of the rows noise and slow")
    parser.add_argument("--snr", default="20,10,5,0,-5,-10,-15", help="of the row noise, dB")
    parser.add_argument("--level", type=float, default=-35.0, help="of the speech, dBFS (RMS)")
    parser.add_argument("--range-noise", default="pink", help="of the rows range and rooms")
    parser.add_argument("--data", type=Path, help="folder of WAVs of people, for the babble")
    parser.add_argument("--out", type=Path, help="folder for table.csv, cost.csv and the plots")
    parser.add_argument("--peer", action=argparse.BooleanOptionalAction, default=True, help="PocketSphinx beside ours")
    parser.add_argument("--wrong", action="store_true", help="print every sentence that was not right")
    parser.add_argument("--conditions", default="", help="of the row worlds (default: all)")
    parser.add_argument("--modes", default=",".join(MODES), help=f"of the row worlds (default {','.join(MODES)})")
    parser.add_argument("--jobs", type=int, default=1, help="processes, for the row worlds (default 1)")
    parser.add_argument("--minutes", type=float, default=60.0, help="of made sounds, in the row sounds (default 60)")
    return parser


def _rows(text: str) -> list[str]:
    known = (*SCORED, *COSTS, *ROBOTS)
    rows = [*SCORED, *COSTS] if text == "all" else text.split(",")
    unknown = [row for row in rows if row not in known]
    if unknown:
        sys.exit(f"--rows: there is no row {unknown[0]!r}; there are {', '.join(known)}")
    return rows


def _score(stage: Stage, rows: list[str], peer: Peer | None, wrong: bool, console: Console) -> Iterator[Result]:
    groups = {name: group for name, group in stage.groups().items() if name in rows}
    if "rooms" in groups and not reverberation.available():
        console.print("rooms: skipped, needs pyroomacoustics (pip install pyroomacoustics)")
        del groups["rooms"]
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("", total=sum(count for count, _ in groups.values()))
        for _, make in groups.values():
            lost: set[str] = set()
            for condition in make():
                progress.update(bar, description=condition.label[:40])
                asked = peer is not None and condition.name not in lost
                theirs = peer.score(condition.sound, condition.spoken) if peer is not None and asked else None
                if theirs is not None and theirs.share == 0.0:
                    lost.add(condition.name)
                found = result(condition, ours(stage.team, condition.sound, condition.spoken), theirs)
                console.print(line(found), highlight=False, markup=False, soft_wrap=True)
                if wrong:
                    for note in found.ours.notes:
                        console.print("    " + note, highlight=False, markup=False, soft_wrap=True)
                progress.advance(bar)
                yield found


def _worlds(o: argparse.Namespace, console: Console) -> None:
    options = worlds.Options(
        tuple(o.names.split(",")),
        o.sentences,
        o.seed,
        o.data,
        tuple(o.modes.split(",")),
        tuple(filter(None, o.conditions.split(","))),
        o.jobs,
        o.peer,
        manner_of(o),
    )
    worlds.run(options, worlds.robot_recogniser, console, o.wrong)


def main() -> None:
    parser = _parser()
    o = parser.parse_args()
    rows = _rows(o.rows)
    if o.out is not None and any(row in SCORED for row in rows) and find_spec("matplotlib") is None:
        parser.error("--out: the plots need matplotlib (pip install matplotlib)")
    options = Options(
        o.sentences,
        o.seed,
        tuple(o.noise.split(",")),
        tuple(float(x) for x in o.snr.split(",")),
        o.level,
        o.range_noise,
        o.data,
    )
    console = Console(width=250, soft_wrap=True, highlight=False)
    if o.out is not None:
        o.out.mkdir(parents=True, exist_ok=True)
    if "worlds" in rows:
        _worlds(o, console)
    team = make_team(o.names.split(","), manner=manner_of(o))
    if "sounds" in rows:
        sounds.run(worlds.robot_recogniser, team, o.data, o.minutes, o.seed, console, o.wrong)
    if "robot" in rows:
        worlds.cost(team, o.seed, o.data, o.minutes, console)
    rows = [row for row in rows if row not in ROBOTS]
    if not rows:
        return
    peer = make_peer(team) if o.peer else None
    if o.peer and peer is None:
        console.print("PocketSphinx: skipped, not installed (pip install pocketsphinx)")
    if any(row in SCORED for row in rows):
        stage = Stage(team, options)
        console.print(f"{o.sentences} sentences a condition, {stage.minutes:.1f} min, names {o.names}, seed {o.seed}")
        console.print(HEADING + (PEER_HEADING if peer is not None else ""), markup=False)
        table = o.out / "table.csv" if o.out is not None else None
        before = read_csv(table) if table is not None else []
        results: list[Result] = []
        for found in _score(stage, rows, peer, o.wrong, console):
            results.append(found)
            if table is not None:
                write_csv(table, joined(before, results))
        console.print(totals(results), markup=False)
        for text in ranges(results):
            console.print(text, markup=False)
        if o.out is not None:
            from benchmarks.hearing import plots

            plots.draw_results(o.out, joined(before, results))
    cost.run([row for row in rows if row in COSTS], team, o.seed, peer is not None, o.out, console)


if __name__ == "__main__":
    main()
