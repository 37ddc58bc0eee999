"""Runs trials in this process, in several, or on a cluster, and saves each row as soon as it is available."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from hvcpd.config.files import write_whole
from hvcpd.config.interruption import handled
from hvcpd.errors import ConfigError, how_to_install
from hvcpd.evaluation.trials import Row, Trial

LOST = "the workers were lost; what is finished is kept, and the same command goes on from there once they are back"
Run = Callable[[Trial], Row]
WITHOUT_DASK = (
    f"several processes need dask.distributed: {how_to_install('dask distributed')}; "
    "or run in one with --jobs 1 and no --scheduler"
)


class KeptRows:
    """The rows of earlier runs and of this one: a line of JSON each, `[key, row]`, written at once."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.rows = dict(_read(path))

    def add(self, trial: Trial, row: Row) -> None:
        """Keep a finished trial's row. Raises OSError."""
        line = json.dumps([trial.key, row], sort_keys=True)
        self.rows[trial.key] = json.loads(line)[1]  # as a later run reads it
        with self._path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")


def _read(path: Path) -> Iterator[tuple[str, Row]]:
    """The readable rows of a file; a last line that was cut off is dropped from it."""
    if not path.exists():
        return
    text = path.read_text(encoding="utf-8", errors="replace")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        write_whole(path, whole.encode())
    for line in whole.splitlines():
        try:
            key, row = json.loads(line)
        except (ValueError, TypeError):
            continue
        if isinstance(key, str) and isinstance(row, dict):
            yield key, row


class Workers:
    """Runs the trials: this process with one job, otherwise a dask cluster, on this machine or the one named.

    Raises ConfigError where dask is needed and not installed, or the scheduler does not answer, or no longer.
    """

    def __init__(self, jobs: int = 1, scheduler: str | None = None) -> None:
        self._jobs, self._scheduler = jobs, scheduler
        self._stack = ExitStack()
        self._client: Any = None

    def __enter__(self) -> Workers:
        if self._jobs > 1 or self._scheduler is not None:
            self._client = self._stack.enter_context(_client(self._jobs, self._scheduler))
        return self

    def __exit__(self, *exception: object) -> None:
        self._stack.close()

    def each(self, run: Run, trials: Sequence[Trial]) -> Iterator[tuple[Trial, Row]]:
        """Every trial with its row, in the order in which they are finished. Raises what a trial raises."""
        if self._client is None:
            for trial in trials:
                yield trial, run(trial)
            return
        from distributed import KilledWorker, as_completed
        from distributed.comm import CommClosedError

        try:
            futures = self._client.map(run, trials, pure=False)
            of = dict(zip((future.key for future in futures), trials, strict=True))
            for future, row in as_completed(futures, with_results=True):
                if isinstance(row, CancelledError):  # dask returns it as if it were the result
                    raise row
                yield of[future.key], row
        except (CancelledError, CommClosedError, KilledWorker) as error:
            first, _, _ = str(error).partition("\n")
            raise ConfigError(f"{LOST} ({first or type(error).__name__})") from None


def _client(jobs: int, scheduler: str | None) -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise ConfigError(WITHOUT_DASK) from None
    if scheduler is None:
        # A terminal sends Ctrl-C to all processes: the others are ended by this one, and print no traceback each.
        with handled(signal.SIG_IGN, signal.SIGINT):
            return Client(n_workers=jobs, threads_per_worker=1, dashboard_address=None, host="127.0.0.1")
    try:
        return Client(scheduler, timeout="10s")
    except (OSError, ValueError) as error:
        raise ConfigError(f"--scheduler {scheduler}: no dask scheduler answers there ({error})") from None


def sweep(
    run: Run,
    trials: Sequence[Trial],
    kept: KeptRows,
    workers: Workers,
    progress: Callable[[int, int], None] = lambda _done, _of: None,
) -> list[Row]:
    """The rows of all trials, in the trials' order whichever process ran them; saved ones are not run again."""
    wanted = [trial for trial in trials if trial.key not in kept.rows]
    done = len(trials) - len(wanted)
    progress(done, len(trials))
    for trial, row in workers.each(run, wanted):
        kept.add(trial, row)
        done += 1
        progress(done, len(trials))
    return [kept.rows[trial.key] for trial in trials]
