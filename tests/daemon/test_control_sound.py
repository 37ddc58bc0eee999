"""What the microphone hears, by the control socket: only for who asks, and only if the settings allow it."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
import pytest

from hvcpd.daemon.control_events import PERIOD_S, SoundTap
from hvcpd.ports import SAMPLE_RATE_HZ
from tests.daemon.control_bench import talking
from tests.robot.test_hold import BLOCK


async def test_who_asks_gets_every_sample_in_order(tmp_path: Path) -> None:
    async with talking(tmp_path, control={"sound": True}) as (bench, talk):
        await bench.live(blocks=3)
        begin_s = bench.bench.robot.now
        assert (await talk.ask("subscribe", events=["sound"]))["ok"]
        n_blocks = round(0.5 * SAMPLE_RATE_HZ / BLOCK)
        await bench.live(blocks=n_blocks)
        first, second = [await talk.line() or {} for _ in range(2)]
        assert first["at_s"] == pytest.approx(begin_s), "from its first sample on, and nothing from before"
        pcm = [np.frombuffer(base64.b64decode(event["pcm"]), "<i2") for event in (first, second)]
        assert second["at_s"] == pytest.approx(begin_s + len(pcm[0]) / SAMPLE_RATE_HZ)
        assert np.concatenate(pcm) / 32767 == pytest.approx(np.full(n_blocks * BLOCK, 0.1), abs=1e-4)


def test_sound_from_before_the_card_was_gone_is_not_told_as_of_later() -> None:
    """Blocks without sound were collected, too: ten a second, all of them added up at each."""
    tap, none = SoundTap(), np.zeros(0, np.float32)
    assert tap.take(np.full(BLOCK, 0.1, np.float32), 1.0) is None
    assert tap.take(none, 3600.0) is None
    told = tap.take(np.full(round(PERIOD_S * SAMPLE_RATE_HZ), 0.2, np.float32), 3600.0 + PERIOD_S)
    assert told is not None
    assert told.at_s == pytest.approx(3600.0)
    assert len(base64.b64decode(told.pcm)) == 2 * PERIOD_S * SAMPLE_RATE_HZ


async def test_a_robot_keeps_what_it_hears_to_itself_unless_its_settings_say_otherwise(tmp_path: Path) -> None:
    async with talking(tmp_path) as (bench, talk):
        refused = await talk.ask("subscribe", events=["heard", "sound"])
        assert "control: {sound: true}" in refused["error"]["text"]
        assert "sound" not in (await talk.ask("subscribe"))["result"]["events"]
        await bench.live(blocks=round(SAMPLE_RATE_HZ / BLOCK))
        assert (await talk.ask("status"))["ok"]
