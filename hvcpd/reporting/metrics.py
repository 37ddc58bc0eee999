"""A robot's status as metrics in Prometheus's text format, for the textfile collector of its node exporter.

Names, units and types as Prometheus has them ("Metric and label naming", "Exposition formats").
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

Sample = tuple[Mapping[str, str], float]
Family = tuple[str, str, str, Iterable[Sample]]
"""Name, type, what it is, and its samples with their own labels."""

TASK_STATES = ("open", "claimed", "done", "left_out")
"""Each is written even if no task is in it, so that a graph has no gaps."""


def metrics_of(status: Mapping[str, Any], heat_c: float | None = None) -> str:
    """Return what `hvcpctl status --json` shows as metrics; what is not known has none. `heat_c`: the processor's."""
    robot = {"robot": str(status["name"])}
    lines: list[str] = []
    for name, kind, text, samples in _families(status, heat_c):
        shown = [f"hvcpd_{name}{_labels({**robot, **labels})} {value:.12g}" for labels, value in samples]
        if shown:
            lines += [f"# HELP hvcpd_{name} {text}", f"# TYPE hvcpd_{name} {kind}", *shown]
    return "\n".join(lines) + "\n"


def _families(status: Mapping[str, Any], heat_c: float | None) -> Iterator[Family]:
    counts, sound, peers, memory = (status[key] for key in ("counts", "sound", "peers", "memory"))
    tasks = {**dict.fromkeys(TASK_STATES, 0), **status["tasks"]}
    version = {"version": str(status["version"]), "team": str(status["team"]), "mode": str(status["mode"])}
    yield "info", "gauge", "The robot and its version.", [(version, 1.0)]
    yield "uptime_seconds", "gauge", "Since the daemon started.", [({}, status["uptime_s"])]
    yield "stopped", "gauge", "Whether the robot was told to stop.", [({}, status["stopped"])]
    yield "speaking", "gauge", "Whether it is speaking.", [({}, status["speaking"])]
    yield "listening", "gauge", "Whether sound comes from the microphone.", [({}, sound["listening"])]
    yield "tasks", "gauge", "Tasks of the board by state.", [({"state": key}, n) for key, n in tasks.items()]
    yield "heard_total", "counter", "Sentences that were understood.", [({}, counts["heard"])]
    yield "heard_confidence_total", "counter", "Their confidences, added up.", [({}, counts["confidence_sum"])]
    yield "garbled_total", "counter", "Speech that was not understood.", [({}, counts["garbled"])]
    yield "said_total", "counter", "Sentences that it said.", [({}, counts["said"])]
    yield "air_seconds_total", "counter", "Time in which it or others spoke.", [({}, counts["air_s"])]
    yield "processor_celsius", "gauge", "Of the processor.", _known({}, heat_c)
    yield "battery_volts", "gauge", "Of the wheels' supply.", _known({}, status["battery_v"])
    yield "sound_level_dbfs", "gauge", "Level of the microphone.", [({}, sound["level_dbfs"])]
    yield "sound_floor_dbfs", "gauge", "Level of the noise.", [({}, sound["floor_dbfs"])]
    lost = [({"kind": kind}, count) for kind, count in sound["lost"].items()]
    yield "sound_lost_total", "counter", "Sound that was lost or late, by kind.", lost
    yield "records_lost_total", "counter", "Records that the memory could not keep.", [({}, memory["lost"])]
    named = [({"peer": str(peer["name"])}, peer) for peer in peers]
    yield "peer_present", "gauge", "Whether a peer is within earshot.", [(of, peer["present"]) for of, peer in named]
    heard = [(of, peer["heard_ago_s"]) for of, peer in named]
    yield "peer_heard_seconds_ago", "gauge", "Since a peer was understood last.", heard
    sure = [(of, peer["confidence"]) for of, peer in named]
    yield "peer_confidence_ratio", "gauge", "Confidence of the last sentence of a peer.", sure
    snrs = [sample for of, peer in named for sample in _known(of, peer["snr_db"])]
    yield "peer_snr_db", "gauge", "Level of a peer's voice above the noise.", snrs


def _known(labels: Mapping[str, str], value: float | None) -> list[Sample]:
    return [] if value is None else [(labels, value)]


def _labels(labels: Mapping[str, str]) -> str:
    return "{" + ",".join(f'{key}="{_quoted(value)}"' for key, value in labels.items()) + "}"


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
