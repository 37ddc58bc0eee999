"""Trials: their own chance, kept rows, the same results whoever runs them."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from hvcpd.errors import ConfigError
from hvcpd.evaluation import robots
from hvcpd.evaluation.runner import KeptRows, Run, Workers, sweep
from hvcpd.evaluation.trials import Row, Scale, Trial

TRIALS = [Trial("dice", 7, {"sides": sides, "throw": k}) for sides in (6, 20) for k in range(3)]


def throw(trial: Trial) -> Row:
    return {"sides": trial.settings["sides"], "shown": int(trial.generator().integers(1, trial.settings["sides"] + 1))}


def test_each_trial_has_a_chance_of_its_own_that_follows_from_what_it_is() -> None:
    draws = [trial.generator().random() for trial in TRIALS]
    assert len(set(draws)) == len(TRIALS)
    again = Trial("dice", 7, {"throw": 0, "sides": 6})
    assert again.key == TRIALS[0].key
    assert again.generator().random() == draws[0]
    assert Trial("dice", 8, {"sides": 6, "throw": 0}).generator().random() != draws[0]


def test_an_interrupted_sweep_goes_on_from_what_it_has(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    run: list[str] = []

    def until_the_fourth(trial: Trial) -> Row:
        if len(run) == 3:
            raise KeyboardInterrupt
        run.append(trial.key)
        return throw(trial)

    def counted(trial: Trial) -> Row:
        run.append(trial.key)
        return throw(trial)

    with Workers() as workers:
        with pytest.raises(KeyboardInterrupt):
            sweep(until_the_fourth, TRIALS, KeptRows(path), workers)
        with path.open("a") as file:
            file.write('["half a li')  # as a process that is killed leaves it
        rows = sweep(counted, TRIALS, KeptRows(path), workers)
    assert run == [trial.key for trial in TRIALS]
    assert rows == [throw(trial) for trial in TRIALS]
    with Workers() as workers:
        assert sweep(until_the_fourth, TRIALS[::-1], KeptRows(path), workers) == rows[::-1]


def test_rows_of_other_settings_or_seeds_are_not_taken(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    others = [Trial("dice", 8, trial.settings) for trial in TRIALS]
    with Workers() as workers:
        first = sweep(throw, TRIALS, KeptRows(path), workers)
        second = sweep(throw, others, KeptRows(path), workers)
    assert second == [throw(trial) for trial in others] != first


def test_lines_that_are_no_rows_are_passed_over(tmp_path: Path) -> None:
    (tmp_path / "r").write_text('5\nnull\n[1, 2]\n{"key": 1}\n[1, 2, 3]\n\n["key", {"shown": 3}]\n')
    assert KeptRows(tmp_path / "r").rows == {"key": {"shown": 3}}


class Backwards(Workers):
    """As several processes may finish: the last trial first."""

    def each(self, run: Run, trials: Sequence[Trial]) -> Iterator[tuple[Trial, Row]]:
        return super().each(run, trials[::-1])


def test_an_experiment_finds_the_same_in_whatever_order_its_trials_are_finished(tmp_path: Path) -> None:
    trials = [t for t in robots.EXPERIMENT.trials(Scale(seed=2, trials=2)) if t.settings["robots"] < 4]
    found = []
    for workers in (Workers(), Backwards()):
        rows = sweep(robots.EXPERIMENT.run, trials, KeptRows(tmp_path / type(workers).__name__), workers)
        found.append((rows, robots.EXPERIMENT.summarise(rows).table))
    assert found[0] == found[1]
    kept = [list(KeptRows(tmp_path / name).rows) for name in ("Workers", "Backwards")]
    assert kept[0] == kept[1][::-1], "they were finished in another order"


def test_progress_counts_what_was_kept(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    with Workers() as workers:
        sweep(throw, TRIALS[:2], KeptRows(tmp_path / "r"), workers)
        sweep(throw, TRIALS[:4], KeptRows(tmp_path / "r"), workers, lambda n, of: told.append((n, of)))
    assert told == [(2, 4), (3, 4), (4, 4)]


@pytest.mark.slow
def test_results_are_the_same_whatever_the_number_of_workers(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="needs dask.distributed, of the eval extra")
    found = []
    for jobs in (1, 2):
        with Workers(jobs) as workers:
            found.append(sweep(throw, TRIALS, KeptRows(tmp_path / str(jobs)), workers))
    assert found[0] == found[1] == [throw(trial) for trial in TRIALS]


def interrupts_ignored(_trial: Trial) -> Row:
    return {"ignored": signal.getsignal(signal.SIGINT) == signal.SIG_IGN}


@pytest.mark.slow
def test_ctrl_c_is_for_who_started_the_processes_alone(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="needs dask.distributed, of the eval extra")
    before = signal.getsignal(signal.SIGINT)
    with Workers(2) as workers:
        assert signal.getsignal(signal.SIGINT) == before != signal.SIG_IGN
        assert sweep(interrupts_ignored, TRIALS[:2], KeptRows(tmp_path / "r"), workers) == [{"ignored": True}] * 2


@pytest.mark.slow
def test_a_cluster_that_is_lost_amid_a_sweep_is_told_and_its_rows_are_kept(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="needs dask.distributed, of the eval extra")
    trials = [Trial("dice", 7, {"sides": 6, "throw": k}) for k in range(2000)]
    kept = KeptRows(tmp_path / "r")
    local = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
    with (
        distributed.LocalCluster(**local, protocol="tcp", host="127.0.0.1") as cluster,
        Workers(scheduler=cluster.scheduler_address) as workers,
        pytest.raises(ConfigError, match="same command"),
    ):
        sweep(throw, trials, kept, workers, lambda done, _: cluster.close() if done == 1 else None)
    assert 1 <= len(KeptRows(tmp_path / "r").rows) < len(trials)


def test_a_scheduler_that_is_not_there_is_named() -> None:
    try:
        import distributed  # noqa: F401
    except ImportError:
        remedy = "pip install"
    else:
        pytest.skip("where dask is installed it looks for the scheduler for 10 s")
    with pytest.raises(ConfigError, match=remedy), Workers(scheduler="tcp://127.0.0.1:1"):
        pass
