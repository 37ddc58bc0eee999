"""The call from recordings of real robots: `evaluate wake --from-recordings DIR`, as docs/experiment.md has it."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.config.names import valid_robot_name
from hvcpd.errors import ConfigError, unreadable
from hvcpd.evaluation import plots
from hvcpd.evaluation.listeners import OURS, book, sentences, sound
from hvcpd.evaluation.statistics import Step, pivot
from hvcpd.evaluation.trials import Findings, Table
from hvcpd.evaluation.wake import PAPER_PIVOT_M
from hvcpd.hardware.soundfile import read_wav

LIST = "recordings.csv"
COLUMNS = ("file", "distance_m", "speaker", "listener", "said")


@dataclass(frozen=True)
class Recording:
    """A file in which `speaker` calls `listener` `said` times from `distance_m` away."""

    path: Path
    distance_m: float
    speaker: str
    listener: str
    said: int


def read_list(folder: Path) -> list[Recording]:
    """The recordings that LIST in `folder` names. Raises ConfigError with all that is wrong with it."""
    path = folder / LIST
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ConfigError(f"{path}: {unreadable(error)}; docs/experiment.md shows what it holds") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: not UTF-8 text; save the file as UTF-8") from None
    rows = csv.DictReader(text.splitlines())
    try:
        listed = [(rows.line_num, row) for row in rows]
    except csv.Error as error:
        raise ConfigError(f"{path}, line {rows.line_num + 1}: {error}") from None
    if tuple(rows.fieldnames or ()) != COLUMNS:
        raise ConfigError(f"{path}: its first line must be: {','.join(COLUMNS)}")
    found: list[Recording] = []
    faults: list[str] = []
    lines: dict[tuple[Path, str, str], int] = {}
    for line, row in listed:
        wrong = list(_wrong(row, folder))
        if not wrong:
            distance_m, said = float(row["distance_m"]), int(row["said"])
            one = Recording(folder / row["file"], distance_m, row["speaker"], row["listener"], said)
            before = lines.setdefault((one.path, one.speaker.lower(), one.listener.lower()), line)
            wrong = [f"the same calls are in line {before}; list them once"] if before != line else []
            found.append(one)
        faults += [f"{path}, line {line}: {fault}" for fault in wrong]
    if not faults and len({recording.distance_m for recording in found}) < 2:
        faults.append(f"{path}: give recordings from two distances at least")
    if faults:
        raise ConfigError("\n".join(faults))
    return found


def _wrong(row: Mapping[str, str | None], folder: Path) -> Iterator[str]:
    if None in row or None in row.values():
        yield f"give {len(COLUMNS)} values: {','.join(COLUMNS)}"
        return
    cells = {name: value or "" for name, value in row.items()}
    if not os.path.isfile(folder / cells["file"]):  # noqa: PTH113 - false for a name that is too long
        yield f"there is no file {cells['file']!r} beside it"
    try:
        if not 0.01 <= float(cells["distance_m"]) <= 10_000.0:
            yield f"distance_m is {cells['distance_m']}, not from 0.01 to 10000"
    except ValueError:
        yield f"distance_m is {cells['distance_m']!r}, not a number of metres"
    if not cells["said"].isdecimal() or not 1 <= int(cells["said"][:6]) <= 10_000:
        yield f"said is {cells['said']!r}, not how often it was called (1 to 10000)"
    yield from (f"{who}: {wrong}" for who in ("speaker", "listener") if (wrong := valid_robot_name(cells[who])))
    if cells["speaker"].lower() == cells["listener"].lower():
        yield "speaker and listener are the same"


def understood(recording: Recording) -> int:
    """Number of calls that our recogniser understands in a recording, more than were `said` if it also hears some where
    nobody spoke, or if the list is wrong. Raises AudioFileError."""
    phrases = book(recording.listener, recording.speaker)
    call = phrases.parse_text(f"Hi {recording.listener}, I am {recording.speaker}")
    understood = sentences(make_speech_recogniser(phrases, (recording.speaker,), sound()), read_wav(recording.path))
    return sum(e.words == phrases.render(call) for e in understood)


def analyse(folder: Path) -> Findings:
    """Our recogniser's results for all recordings of a folder. Raises ConfigError and AudioFileError."""
    recordings = read_list(folder)
    return findings(recordings, [understood(recording) for recording in recordings])


def findings(recordings: Sequence[Recording], right: Sequence[int]) -> Findings:
    """Shares by distance and the pivotal distance; `right`: number of calls understood in each recording, of which as
    many count as were said."""
    surplus = [
        f"In {recording.path.name} {n} calls from {recording.speaker} to {recording.listener} were understood and "
        f"{recording.said} said; {recording.said} are counted. Listen to it, and check the list."
        for n, recording in zip(right, recordings, strict=True)
        if n > recording.said
    ]
    right = [min(n, recording.said) for n, recording in zip(right, recordings, strict=True)]
    distances = sorted({recording.distance_m for recording in recordings})
    steps = tuple(
        Step(
            at,
            sum(n for n, recording in zip(right, recordings, strict=True) if recording.distance_m == at),
            sum(recording.said for recording in recordings if recording.distance_m == at),
        )
        for at in distances
    )
    half = pivot(steps)
    series = [plots.Series("recorded", OURS, steps, half)]
    table = tuple((s.at, s.n, s.right, *s.shares) for s in steps)
    return Findings(
        "The call, recorded",
        (
            f"{sum(s.right for s in steps)} of {sum(s.n for s in steps)} recorded calls were understood; half "
            f"of them at {half.text()}. The paper's pivotal distance is {PAPER_PIVOT_M * 100:.0f} cm.",
            *surplus,
        ),
        Table(("distance_m", "calls", "right", "share", "low", "high"), table),
        lambda figure: plots.against_distance(figure, series, "calls understood, %", PAPER_PIVOT_M),
    )
