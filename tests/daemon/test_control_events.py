"""What a robot's records are as events of the control socket."""

from __future__ import annotations

import pytest

from hvcpd.daemon.control_events import KINDS, EventSource, Meter
from hvcpd.reporting.events import Noted
from hvcpd.robot.records import DoubtRecord, Record, VoiceRecord
from tests.robot.test_hold import Bench


@pytest.mark.parametrize(
    ("record", "text"),
    [
        (VoiceRecord(1.0, "Bot", "oak", "elm"), "another voice than Bot's: oak, not elm"),
        (DoubtRecord(1.0, "Bot", "Hi Rob, I am Bot, turn left", "no seal"), "not believed: no seal"),
    ],
)
def test_what_a_robot_thinks_of_a_speaker_is_told(record: Record, text: str) -> None:
    told = EventSource("Rob", Meter()).of_step(Bench().robot, [record], False)
    assert Noted(1.0, "Rob", "Bot", text) in list(told)
    assert "noted" in KINDS
