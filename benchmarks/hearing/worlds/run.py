"""The rows of `worlds`: trials by condition and mode, ours and PocketSphinx's, with Wilson's intervals."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from benchmarks.hearing.listeners import Peer, make_peer
from benchmarks.hearing.material import Team, make_team
from benchmarks.hearing.noises import steady
from benchmarks.hearing.worlds import stages
from benchmarks.hearing.worlds.conditions import Condition, conditions
from benchmarks.hearing.worlds.trials import MakeRecogniser, Tally, hear, make_trial, ours, theirs
from benchmarks.manner import USUAL, Manner
from hil_fakes import reverberation
from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.plan import HearingPlan
from hvcpd.evaluation.statistics import wilson
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.stages import SpeechRecogniser, SynchronousWorker

MODES = ("first", "acquainted")
NOISE_DBFS = -50.0
"""Of noise alone: a quiet room's, by a microphone of usual gain."""
HEADING = f"{'condition':44} {'mode':10} {'right':>8} {'95 %':>12} {'wrong':>5} {'95 %':>11} {'lost':>5}    rtf"
PEER_HEADING = " | PocketSphinx: right wrong    rtf"


@dataclass(frozen=True)
class Options:
    """The options of the command line."""

    names: tuple[str, ...]
    sentences: int
    seed: int
    data: Path | None
    modes: tuple[str, ...] = MODES
    wanted: tuple[str, ...] = ()
    jobs: int = 1
    peer: bool = True
    manner: Manner = USUAL


@dataclass(frozen=True)
class Row:
    """One line of the table: both tallies; `parts` of two robots at once, by which of them."""

    condition: Condition
    mode: str
    part: str
    ours: Tally
    peer: Tally | None


def robot_recogniser(team: Team) -> SpeechRecogniser:
    """The first robot's ears with recognition of strangers. They have heard nothing, and know all words."""
    hearing = HearingPlan(channel=SynchronousWorker(), second=SynchronousWorker())
    return make_speech_recogniser(team.book, team.names, team.sound, hearing, books=team.books, name=team.names[0])


class Bench:
    """Runs trials; in other processes where more than one job is asked for."""

    def __init__(self, options: Options, make_speech_recogniser: MakeRecogniser) -> None:
        self.options = options
        self.make_speech_recogniser = make_speech_recogniser
        self.team = make_team(options.names, manner=options.manner)
        self.peer: Peer | None = make_peer(self.team) if options.peer else None
        found = conditions(options.seed, options.data)
        names = {c.name for c in found}
        for name in options.wanted:
            if name not in names:
                raise SystemExit(f"--conditions: there is no {name!r}; there are {', '.join(c.name for c in found)}")
        self.conditions = [c for c in found if not options.wanted or c.name in options.wanted]

    def trial(self, job: tuple[int, str, int]) -> tuple[Tally, Tally | None]:
        """Condition, mode and number of a trial: how ours and PocketSphinx fared."""
        index, mode, number = job
        o = self.options
        trial = make_trial(self.team, self.conditions[index], number, o.seed, mode == "acquainted", o.data)
        return ours(self.make_speech_recogniser, self.team, trial), theirs(self.peer, trial) if self.peer else None

    def rows(self) -> Iterator[Row]:
        """Condition by condition, mode by mode."""
        for index, condition in enumerate(self.conditions):
            for mode in self.options.modes:
                jobs = [(index, mode, number) for number in range(self.options.sentences)]
                yield from _rows(condition, mode, list(self._map(jobs)))

    def _map(self, jobs: list[tuple[int, str, int]]) -> Iterator[tuple[Tally, Tally | None]]:
        if self.options.jobs == 1:
            yield from map(self.trial, jobs)
            return
        global _bench
        _bench = self
        with multiprocessing.get_context("fork").Pool(self.options.jobs) as pool:
            yield from pool.imap(_trial, jobs)


_bench: Bench | None = None


def _trial(job: tuple[int, str, int]) -> tuple[Tally, Tally | None]:
    assert _bench is not None
    return _bench.trial(job)


def _rows(condition: Condition, mode: str, found: list[tuple[Tally, Tally | None]]) -> Iterator[Row]:
    for k, part in enumerate(condition.parts):
        mine, other = Tally(), Tally()
        for tally, peer in found:
            mine.add(Tally(tally.verdicts[k : k + 1], tally.seconds, tally.heard_s))
            if peer is not None:
                other.add(Tally(peer.verdicts[k : k + 1], peer.seconds, peer.heard_s))
        yield Row(condition, mode, part, mine, other if other.verdicts else None)


def line(row: Row) -> str:
    """One line of the table."""
    t, n = row.ours, len(row.ours.verdicts)
    right, wrong = t.count("right"), t.count("wrong")
    label = row.condition.label + (f": {row.part}" if row.part else "")
    text = (
        f"{label:44} {row.mode:10} {right:4d}/{n:<3d} {_interval(right, n):>12} {wrong:5d} {_interval(wrong, n):>11}"
        f" {t.count('lost'):5d} {t.seconds / max(t.heard_s, 1e-9):6.3f}"
    )
    if row.peer is not None:
        p = row.peer
        rtf = p.seconds / max(p.heard_s, 1e-9)
        text += f" | {p.count('right'):13d}/{len(p.verdicts):<4d} {p.count('wrong'):5d} {rtf:6.3f}"
    return text


def sources(row: Row) -> str:
    """The sources of right and wrong reports; empty if there are none."""
    told = []
    for outcome in ("right", "wrong"):
        by = row.ours.sources(outcome)
        if by:
            told.append(f"{outcome} by " + ", ".join(f"{name} {count}" for name, count in by.most_common()))
    return "; ".join(told)


def cost(team: Team, seed: int, data: Path | None, minutes: float, console: Console) -> None:
    """Print what a whole robot's ears cost once they are ready, and each stage of them, processor time over the sound's
    duration: in noise alone, and while a robot says three sentences in a row, in measured rooms or else through a small
    loudspeaker."""
    named = {condition.name: condition for condition in conditions(seed, data)}
    condition = named.get("measured", named["small-vacuum"])
    talk = [make_trial(team, condition, number, seed, True, data).sound for number in range(3)]
    rms = 10.0 ** (NOISE_DBFS / 20.0)
    alone = np.asarray(rms * steady("pink", round(60.0 * minutes * SAMPLE_RATE_HZ), seed), np.float32)
    for label, sounds in (("pink noise alone", [alone]), (condition.label, talk)):
        recogniser = robot_recogniser(team)
        hear(recogniser, sounds[0][: 3 * SAMPLE_RATE_HZ])  # what is made once, before anybody speaks
        with stages.timed() as spent:
            seconds = sum(hear(recogniser, sound)[1] for sound in sounds)
        heard_s = sum(map(len, sounds)) / SAMPLE_RATE_HZ
        console.print(f"{label}: {seconds / heard_s:.4f} of real time ({heard_s:.0f} s)", markup=False)
        spent["all else"] = seconds - sum(spent.values())
        for stage, of_it in sorted(spent.items(), key=lambda item: -item[1]):
            console.print(f"    {stage:15} {of_it / heard_s:.4f}", markup=False)


def _interval(count: int, n: int) -> str:
    low, high = wilson(count, n)
    return f"{100 * low:.0f}-{100 * high:.0f} %"


def run(
    options: Options, make_speech_recogniser: MakeRecogniser, console: Console, tell_wrong: bool = False
) -> list[Row]:
    """Print the table line by line; returns its rows."""
    bench = Bench(options, make_speech_recogniser)
    if not reverberation.available():
        skipped = [c.name for c in bench.conditions if c.simulated]
        bench.conditions = [c for c in bench.conditions if not c.simulated]
        console.print(f"skipped, because pyroomacoustics is missing: {', '.join(skipped)}")
    console.print(HEADING + (PEER_HEADING if bench.peer is not None else ""), markup=False)
    rows = []
    for row in bench.rows():
        rows.append(row)
        console.print(line(row), markup=False)
        if by := sources(row):
            console.print("    " + by, markup=False)
        if tell_wrong:
            for v in row.ours.verdicts:
                if v.outcome != "right":
                    instead = " + ".join(f"{text} [{source}]" for source, text in v.instead) or "lost"
                    console.print(f"        {' '.join(v.words)} -> {instead}", markup=False)
    verdicts = [v for row in rows for v in row.ours.verdicts]
    n, right = len(verdicts), sum(v.outcome == "right" for v in verdicts)
    wrong = sum(v.outcome == "wrong" for v in verdicts)
    console.print(
        f"{n} sentences: {right} right ({_interval(right, n)}), {wrong} wrong ({_interval(wrong, n)}), "
        f"{n - right - wrong} lost",
        markup=False,
    )
    return rows
