"""docs/ros.md names the topics, parameters and times that there are."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

from hvcpd.daemon import base_request_handler
from hvcpd.hardware import motion, ros_base
from hvcpd.ros import bridge, driving, master, parameters, topics

PAGE = (Path(__file__).parents[2] / "docs" / "ros.md").read_text(encoding="utf-8")


def test_every_topic_is_in_the_table_with_its_type() -> None:
    rows = re.findall(r"^\| (`[^|]+`) \| (\w+)/(\w+) \| (in|out)(, latched)? \|", PAGE, re.M)
    told = {
        (name, kind, bool(latched)) for names, _, kind, _, latched in rows for name in re.findall(r"`([^`]+)`", names)
    }
    every = (*topics.published(True), *topics.published(False), *topics.SUBSCRIBED, topics.ODOM)
    assert told == {(each.name, each.type.__name__, each.latched) for each in every}


def test_the_events_that_are_passed_on_are_named() -> None:
    told = re.search(r"of the control socket, as JSON: ([\w, ]+) \|", PAGE)
    assert told is not None
    assert told[1].split(", ") == [*bridge.EVENT_KINDS]


def test_every_parameter_is_named_with_its_default() -> None:
    text = PAGE.partition("## Parameters")[2].partition("\n## ")[0]
    defaults = dataclasses.asdict(parameters.Parameters()) | {"action": "move_base"}
    told = dict(re.findall(r"`~(\w+)` \((\w+)", text))
    assert told == {name: str(value).lower() for name, value in defaults.items()}


def test_the_times_are_those_of_the_code() -> None:
    assert f"no odometry for {ros_base.FRESH_S:g} s" in PAGE
    assert f"the daemon silent for {driving.LEASE_S:g} s" in PAGE
    assert f"asks it every {master.EVERY_S:g} s" in PAGE
    assert f"publishes zero for {driving.ZEROS_S:g} s" in PAGE
    assert f"After {base_request_handler.GONE_S:g} s without a base" in PAGE
    assert f"{motion.PATIENCE_S:g} s the motion has failed" in PAGE
    assert f"{bridge.MAX_SAYS:d} may wait".replace("5", "five") in PAGE
