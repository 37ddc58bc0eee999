"""`hvcpctl evaluate`: the paper's experiments, on a simulated bench."""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hvcpd.control.output import print_note
from hvcpd.errors import AudioFileError, ConfigError, how_to_install, writing
from hvcpd.evaluation.experiments import ALL, experiment, missing
from hvcpd.evaluation.report import plots_available, write_findings, write_page
from hvcpd.evaluation.runner import KeptRows, Workers, sweep
from hvcpd.evaluation.trials import Findings, Scale
from hvcpd.reporting.text import plural

if TYPE_CHECKING:
    from rich.progress import Progress

INTERVALS = "Intervals are of 95 % (shares: Wilson; pivotal distances: profile likelihood)."


def run(options: argparse.Namespace) -> None:
    """Run one experiment or all, write the findings, and print where."""
    if options.from_recordings is not None and options.experiment != "wake":
        raise ConfigError(f"--from-recordings: {options.experiment} has no recordings; use it with wake")
    names: Sequence[str] = ALL if options.experiment == "all" else (options.experiment,)
    scale = Scale(options.seed, options.trials, options.quick, options.missions)
    with writing(options.out, AudioFileError, "--out: ", "name another directory"):
        options.out.mkdir(parents=True, exist_ok=True)
        if options.from_recordings is not None:
            found = [_of_recordings(options.from_recordings, options.out)]
            about = f"From the recordings in {options.from_recordings}. {INTERVALS}"
        else:
            found, about = _run_all(_possible(names, alone=options.experiment != "all"), scale, options), _about(scale)
        page = write_page(found, about, options.out)
    for _, one in found:
        sys.stdout.write("\n".join((one.title, *(f"  {text}" for text in one.paragraphs), "")) + "\n")
    drawn = any(one.draw is not None for _, one in found)
    if drawn and not plots_available():
        print_note(f"note: no plots without matplotlib ({how_to_install('matplotlib')})")
    plot = " and a plot" if drawn and plots_available() else ""
    rows = ", and the rows of all trials" if options.from_recordings is None else ""
    sys.stdout.write(f"Report: {page}; beside it a CSV{plot} of each experiment{rows}.\n")


def _of_recordings(folder: Path, out: Path) -> tuple[str, Findings]:
    from hvcpd.evaluation.recordings import analyse

    name, found = "wake-recorded", analyse(folder)
    write_findings(name, found, out)
    return name, found


def _possible(names: Sequence[str], alone: bool) -> Sequence[str]:
    """Return the experiments that this machine can run; others are named, or are an error where nothing else was
    asked for."""
    lacking = {name: modules for name in names if (modules := missing(name))}
    for name, modules in lacking.items():
        text = f"evaluate {name} needs {' and '.join(modules)}, not installed: {how_to_install(' '.join(modules))}"
        if alone:
            raise ConfigError(text)
        print_note(f"note: left out: {text}")
    return [name for name in names if name not in lacking]


def _run_all(names: Sequence[str], scale: Scale, options: argparse.Namespace) -> list[tuple[str, Findings]]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    found = []
    with (
        Workers(_jobs(options), options.scheduler) as workers,
        Progress(*columns, console=Console(stderr=True)) as progress,
    ):
        for name in names:
            this, kept = experiment(name), KeptRows(options.out / f"{name}.rows.jsonl")
            one = this.summarise(sweep(this.run, this.trials(scale), kept, workers, _bar(progress, name)))
            write_findings(name, one, options.out)
            found.append((name, one))
    return found


def _bar(progress: Progress, name: str) -> Callable[[int, int], None]:
    bar = progress.add_task(name, total=None)
    return lambda done, of: progress.update(bar, completed=done, total=of)


def _jobs(options: argparse.Namespace) -> int:
    """The number of processes: as requested, else one for each core, or a single one without dask."""
    if options.jobs is not None:
        return int(options.jobs)
    return (os.cpu_count() or 1) if importlib.util.find_spec("distributed") is not None else 1


def _about(scale: Scale) -> str:
    size = "a quick look with few steps" if scale.quick else "all steps"
    trials = f"{plural(scale.trials, 'trial')} a step ({scale.missions_each} of whole robots)"
    return f"Seed {scale.seed}, {trials}, {size}. Everything here is simulated: no robot, no air. {INTERVALS}"
