"""Other recognisers on the same audio: what is counted for whom, and what each costs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from hvcpd.evaluation import footprint, peers
from hvcpd.evaluation.listeners import MAKERS, OURS, PEER, PORCUPINE, WAKE_WORDS, Listen, Said, available, called
from hvcpd.evaluation.trials import Scale
from hvcpd.ports import SAMPLE_RATE_HZ, Samples


def test_a_wake_word_counts_for_the_sentence_that_it_was_reported_in() -> None:
    said = [Said(("hi", "jarvis"), 16_000, 32_000), Said(("hi", "computer"), 64_000, 80_000)]
    found = [(15_000, "Jarvis"), (30_000, "Jarvis"), (84_000, "Bumblebee"), (95_000, "Computer")]
    assert called(found, said) == ["jarvis", "bumblebee"]
    assert called([(20_000, "Jarvis"), (39_000, "Jarvis")], said) == ["jarvis jarvis", ""]


def row(noise: float | None, distance_m: float, right: dict[str, int]) -> dict[str, Any]:
    counts = {**right, **{f"{name} wrong": [] for name in right}}
    return {
        "part": peers.SUCCESS,
        "robot_noise_db_spl": noise,
        "distance_m": distance_m,
        "listeners": list(right),
        "calls": 4,
        **counts,
    }


def test_each_listener_is_told_of_with_what_it_reaches_and_costs() -> None:
    rows = [
        row(noise, d, {OURS: 4, PEER: 4 * (d < 1.2), PORCUPINE: 2 * (d < 1.2)})
        for noise in (None, 57.5)
        for d in (0.5, 1.0, 1.44, 8.0)
    ]
    cost = {"start_s": 0.5, "share": 0.025, "memory_mb": 71.0, "bare_mb": 48.0}
    rows.append({"part": peers.COST, "listener": OURS, "robot_noise_db_spl": 57.5, **cost})
    found = peers.EXPERIMENT.summarise(rows)
    text = " ".join(found.paragraphs)
    assert f"{PEER}, robot 57.5 dB: half of the calls at 1.2" in text
    assert f"{OURS}: 2.5 % of one core while it listens, 71 MB" in text
    cells = [dict(zip(found.table.columns, line, strict=True)) for line in found.table.rows]
    assert len(cells) == 2 * 3 * 4
    assert {c["processor_share"] for c in cells if c["listener"] == OURS} == {0.025}
    assert {c["processor_share"] for c in cells if c["listener"] == PEER} == {""}


def test_everybody_hears_the_same_sound() -> None:
    trials = peers.EXPERIMENT.trials(Scale(quick=True))
    success = [t for t in trials if t.settings["part"] == peers.SUCCESS]
    assert {tuple(t.settings["listeners"]) for t in success} == {tuple(available(*MAKERS))}
    assert [t.settings["listener"] for t in trials if t not in success] == available(*MAKERS)
    assert len({t.key for t in trials}) == len(trials)


def test_listening_is_what_is_measured() -> None:
    sound = np.zeros(SAMPLE_RATE_HZ, np.float32)
    kept: list[Samples] = []

    def make() -> Listen:
        kept.append(np.ones(64_000_000, np.float32))  # 256 MB, touched; what other tests leave behind is far less

        def listen(heard: Samples, said: Sequence[Said]) -> list[str]:
            return [str(sum(range(3_000_000)) + len(heard) + len(said))]

        return listen

    found = footprint.measure(make, sound, [])
    assert found.memory_mb > found.bare_mb + 200.0
    assert found.share > 0.001  # of a second's sound
    assert found.start_s >= 0.0


def test_ours_listens_in_a_process_of_its_own() -> None:
    found = footprint.measured(OURS, np.zeros(SAMPLE_RATE_HZ, np.float32), [Said((), 0, 100)])
    assert found.memory_mb >= found.bare_mb > 10.0


@pytest.mark.slow
def test_ours_understands_calls_to_each_of_the_names() -> None:
    pytest.importorskip("pyroomacoustics", reason="needs pyroomacoustics, of the eval extra")
    trial = peers.EXPERIMENT.trials(Scale(quick=True))[0]
    assert peers.EXPERIMENT.run(trial)[OURS] == len(WAKE_WORDS)
