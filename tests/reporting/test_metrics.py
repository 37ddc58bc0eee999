"""A robot's status as Prometheus reads it: every line well formed, what is unknown left out."""

from __future__ import annotations

import re
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from hvcpd.reporting.metrics import metrics_of

STATUS: dict[str, Any] = {
    "name": "Rob",
    "team": "plant",
    "mode": "volunteer",
    "version": "1.0",
    "uptime_s": 12.5,
    "stopped": False,
    "speaking": True,
    "tasks": {"done": 2},
    "battery_v": 11.9,
    "counts": {"heard": 1_234_567, "said": 7, "garbled": 2, "confidence_sum": 4.9, "air_s": 61.5},
    "sound": {"listening": True, "level_dbfs": -20.0, "floor_dbfs": -60.0, "lost": {"input_overflows": 3}},
    "memory": {"lost": 0},
    "peers": [{"name": "Bot", "present": True, "heard_ago_s": 4.0, "confidence": 0.98, "snr_db": None}],
}
SAMPLE = re.compile(r'hvcpd_[a-z_]+\{[a-z]+="(?:[^"\\\n]|\\.)*"(?:,[a-z]+="(?:[^"\\\n]|\\.)*")*\} -?[0-9.e+]+')
"""As the exposition format has a sample with labels."""


def test_what_is_known_is_told_with_its_robot() -> None:
    lines = metrics_of(STATUS).splitlines()
    assert 'hvcpd_battery_volts{robot="Rob"} 11.9' in lines
    assert 'hvcpd_tasks{robot="Rob",state="done"} 2' in lines
    assert 'hvcpd_tasks{robot="Rob",state="open"} 0' in lines
    assert 'hvcpd_peer_confidence_ratio{robot="Rob",peer="Bot"} 0.98' in lines
    assert 'hvcpd_sound_lost_total{robot="Rob",kind="input_overflows"} 3' in lines
    assert 'hvcpd_speaking{robot="Rob"} 1' in lines
    assert 'hvcpd_heard_total{robot="Rob"} 1234567' in lines, "a counter keeps all its digits"
    assert 'hvcpd_air_seconds_total{robot="Rob"} 61.5' in lines
    assert not [line for line in lines if "celsius" in line]
    assert 'hvcpd_processor_celsius{robot="Rob"} 48.3' in metrics_of(STATUS, 48.3).splitlines()
    assert not [line for line in lines if "snr" in line], "it is not known, and so has no line at all"


def test_a_robot_that_starts_has_no_battery_and_no_peers() -> None:
    text = metrics_of({**STATUS, "battery_v": None, "peers": [], "tasks": {}})
    assert "battery" not in text
    assert "peer" not in text


@given(st.text(min_size=1), st.floats(-1e6, 1e6))
def test_every_line_is_well_formed_whatever_a_peer_is_called(name: str, value: float) -> None:
    peer = {**STATUS["peers"][0], "name": name, "heard_ago_s": value}
    text = metrics_of({**STATUS, "peers": [peer]})
    assert text.endswith("\n")
    for line in text.split("\n")[:-1]:
        assert line.startswith(("# HELP hvcpd_", "# TYPE hvcpd_")) or SAMPLE.fullmatch(line.replace("e-", "e+")), line
