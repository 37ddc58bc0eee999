"""`hvcpctl report`: a shift, printed and drawn, from a robot's transcript."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable
from contextlib import closing

from hvcpd.config.task_changes import read_changes
from hvcpd.config.tasks import TaskDefinition
from hvcpd.control.live.transcript import AskedRows, open_transcript, since_wall_s
from hvcpd.control.output import show
from hvcpd.control.simulate.team import load_team
from hvcpd.errors import ConfigError, writing
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.memory.store import TranscriptReader, TranscriptRow
from hvcpd.reporting.shift import read_shift
from hvcpd.reporting.shift_page import as_json, as_text, write_shift


def run(options: argparse.Namespace, now_s: Callable[[], float] = time.time) -> None:
    """Print the shift, and with --html draw it."""
    end_s = now_s()
    since_s, rows, phrasebook, tasks = read_transcript(options, end_s)
    shift = read_shift(rows, phrasebook, tasks, (since_s, end_s))
    if options.html is not None:
        with writing(options.html, ConfigError, "--html: "):
            write_shift(shift, options.html)
    show(options.json, as_json(shift), *as_text(shift).splitlines())


def read_transcript(
    options: argparse.Namespace, now_s: float
) -> tuple[float, tuple[TranscriptRow, ...], Phrasebook, tuple[TaskDefinition, ...]]:
    """The time of `--since`, seconds since 1970, the transcript from then on, and its sentences and tasks. Raises
    ConfigError, also for a time of which nothing can be told, and PhraseError."""
    since_s = since_wall_s(options.since, now_s)
    if since_s > now_s:
        raise ConfigError(f"--since {options.since} is yet to come; give a time that has passed")
    with closing(open_transcript(options)) as reader:
        rows = reader.rows(since_wall_s=since_s)
        return since_s, rows, *vocabulary_of(reader, rows, options)


def vocabulary_of(
    reader: AskedRows | TranscriptReader, rows: Iterable[TranscriptRow], options: argparse.Namespace
) -> tuple[Phrasebook, tuple[TaskDefinition, ...]]:
    """The sentences and the tasks of a transcript, with the names of all who speak in it: those of the settings, or, if
    the robot that was asked for it has other tasks, as much of its own as it tells. Beside a memory's file is that of
    the tasks that commands have given that robot, or taken from it. Raises ConfigError and PhraseError."""
    speakers = tuple(sorted({row.record.speaker for row in rows if row.record.speaker}))
    changes = None
    if isinstance(reader, TranscriptReader) and options.tasks is None:
        changes = read_changes(reader.path.with_suffix(".tasks.yaml"))
    team = load_team(options, more=speakers, sealed=True, changes=changes)
    tasks = reader.tasks() if isinstance(reader, AskedRows) else team.tasks.tasks
    if not isinstance(reader, AskedRows) or _named(tasks) == _named(team.tasks.tasks):
        return team.phrasebook, tasks
    return Phrasebook(reader.vocabulary(speakers)), tasks


def _named(tasks: Iterable[TaskDefinition]) -> dict[int, str]:
    return {task.number: task.name for task in tasks}
