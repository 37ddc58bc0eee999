"""The simulated room between real sound devices: carries, after a restart of the sound server too, and records."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import wave
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from hil_fakes.pulse_pipe import PipeError, PulsePipe
from hil_fakes.room import Air
from hil_fakes.sound_server import LOUDSPEAKER, MICROPHONE, SoundServer
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from tests.e2e import parts

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(parts.missing()), reason=parts.missing())]

TONE_HZ, LEVEL = 1000.0, 0.5
BLOCK = 320
LATENCY_S = 0.05
ENOUGH = 20
"""Blocks with the tone, of which the loudest counts: a busy machine tears gaps."""
TRIES = 1000
"""Blocks of 20 ms until the tone must have come: as long as a busy machine may need to find the server again."""


@pytest.fixture
def server(tmp_path: Path) -> Iterator[SoundServer]:
    with (
        tempfile.TemporaryDirectory(prefix="sound-") as runtime,
        SoundServer(Path(runtime), ["rob", "bot"], tmp_path / "server.log", parts.PRIORITY) as server,
    ):
        yield server


@pytest.fixture
def air(server: SoundServer, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    options = ["--server", str(server.socket), "--robots", "rob,bot", "--record", str(tmp_path), "--noise-db", "0"]
    command = [*parts.PRIORITY, sys.executable, "-m", "hil_fakes.real_air", *options]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        yield process
        process.communicate()


def heard_of_rob(server: SoundServer) -> tuple[float, float]:
    """The amplitude of Rob's tone as Rob's and Bot's microphones take it."""
    tone = LEVEL * np.sin(2 * np.pi * TONE_HZ * np.arange(BLOCK) / SAMPLE_RATE_HZ)
    heard: list[tuple[float, float]] = []
    with ExitStack() as stack:
        mouth = stack.enter_context(PulsePipe(str(server.socket), "play", f"rob_{LOUDSPEAKER}", LATENCY_S))
        rob, bot = (
            stack.enter_context(PulsePipe(str(server.socket), "record", f"{name}_{MICROPHONE}.monitor", LATENCY_S))
            for name in ("rob", "bot")
        )
        for _ in range(TRIES):
            mouth.write(tone)
            pair = amplitude(rob.read(BLOCK)), amplitude(bot.read(BLOCK))
            heard += [pair] if min(pair) > 0.0 else []
            if len(heard) == ENOUGH:
                break
    return max(own for own, _ in heard), max(others for _, others in heard)


def amplitude(block: Samples) -> float:
    """Of a sine."""
    return float(np.sqrt(2.0 * np.mean(np.square(block))))


def test_what_one_plays_the_other_hears_fainter_also_after_the_server_was_killed(
    server: SoundServer, air: subprocess.Popen[str], tmp_path: Path
) -> None:
    own, others = heard_of_rob(server)
    gain = Air().source_gain
    assert others == pytest.approx(LEVEL * gain, rel=0.05)  # at 1 m
    assert own == pytest.approx(LEVEL * gain / Air().own_distance_m, rel=0.05)
    server.kill()
    with pytest.raises(PipeError, match=r"does not open: Connection refused"):
        PulsePipe(str(server.socket), "play", f"rob_{LOUDSPEAKER}", LATENCY_S)
    server.start()
    assert heard_of_rob(server)[1] == pytest.approx(others, rel=0.05)

    _, told = air.communicate()
    assert told.startswith("the server was found 2 times")
    with wave.open(str(tmp_path / "heard-by-bot.wav")) as recording:
        assert recording.getframerate() == SAMPLE_RATE_HZ
        samples = np.frombuffer(recording.readframes(recording.getnframes()), "<i2") / 32768.0
    assert np.abs(samples).max() == pytest.approx(others, rel=0.05)


def test_a_device_that_is_not_there_is_named(server: SoundServer) -> None:
    with pytest.raises(PipeError, match=r"max_loudspeaker on .*: No such entity"):
        PulsePipe(str(server.socket), "play", f"max_{LOUDSPEAKER}", LATENCY_S)


def test_a_server_that_cannot_start_says_where_to_look(tmp_path: Path) -> None:
    log = tmp_path / "server.log"
    broken = SoundServer(tmp_path, ["rob"], log, ("false",))
    with pytest.raises(TimeoutError, match=rf"status 1; see {log}"):
        broken.start()
