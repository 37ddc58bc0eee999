"""`hvcpctl duet`: whole daemons in one room, somebody who types, and a card that all share."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest

from hil_fakes.body import Body
from hil_fakes.room import Air, Room
from hil_fakes.shared_card import SharedCard
from hil_fakes.shared_room import BLOCK, SharedRoom, SimulatedAir
from hvcpd.config.settings import load_settings
from hvcpd.control.cli import make_parser
from hvcpd.control.duet.duet import VISITOR, Duet, choose_medium
from hvcpd.control.duet.onlookers import Visitor
from hvcpd.coordination.states import State
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import DeviceError, HvcpdError
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.ports import Pose, Samples

STOP_S = 21.0
"""When nobody speaks: both have greeted, and nobody has a task yet."""


class OverError(HvcpdError):
    """The test has seen enough."""


def wiring(folder: Path, units: Path, name: str, place: int) -> Wiring:
    state = folder / name
    state.mkdir()
    (state / "units").symlink_to(units)
    given = {"name": name, "names": ["Rob", "Bot"], "state_dir": str(state), "seed": 3}
    given |= {"start.x_m": place - 5.0, "control.socket": str(folder / f"{name}.sock")}
    return wire_up(load_settings(None, given, system_path=folder / "none.yaml"))


@contextmanager
def duet(folder: Path, units: Path, watch: Callable[[float], None]) -> Iterator[tuple[Duet, SharedRoom, io.StringIO]]:
    """Rob and Bot in virtual time, and what the terminal shows."""
    wirings = [wiring(folder, units, name, place) for place, name in enumerate(("Rob", "Bot"))]
    with ExitStack() as stack:
        bodies = [stack.enter_context(Body(w.settings.start.pose, k)) for k, w in enumerate(wirings)]
        medium = SimulatedAir(Room(2, Air(), seed=0))
        plays = SharedRoom(bodies, watch, medium=medium)
        out = io.StringIO()
        yield Duet(wirings, plays, Visitor(VISITOR, wirings[0], medium.say), out, ready="All listen\n"), plays, out


@pytest.mark.slow
def test_robots_talk_and_obey_who_types(tmp_path: Path, units: Path) -> None:
    """From the greeting to a typed "stop"; who types something else is told what may be said."""
    script = {1.0: "this is no sentence", STOP_S: "bot stop"}

    def watch(now_s: float) -> None:
        if script and now_s >= min(script):
            both.say(script.pop(min(script)))
        if now_s >= STOP_S + 6.0:
            raise OverError("the test has seen enough")

    with duet(tmp_path, units, watch) as (both, room, out):
        for stream, daemon in zip(room.streams, both.daemons, strict=True):
            stream.settled = daemon.settled
        with (tmp_path / "nothing").open("w+") as typed, pytest.raises(OverError):
            asyncio.run(both.live(typed))
        assert both.daemons[1].robot is not None
        assert both.daemons[1].robot.coordination.state is State.STOPPED
    assert out.getvalue().count("All listen\n") == 1
    assert "'this' is not in the phrasebook" in out.getvalue()
    assert "Hi all, I am Bot, member of team plant" in out.getvalue()
    assert "I have stopped" in out.getvalue()


class TapeCard:
    """A sound card that hears a ramp of samples, and keeps what it played."""

    def __init__(self) -> None:
        self.latency_s, self.counters = 0.05, StreamCounters()
        self.played: list[Samples] = []
        self.is_open = False

    async def open(self, afresh: bool = False) -> None:
        self.is_open = True

    async def start(self) -> None:
        assert self.is_open

    async def read(self) -> Samples:
        return np.full(BLOCK, len(self.played) / 8, np.float32)

    def write(self, samples: Samples) -> None:
        self.played.append(samples)

    async def close(self) -> None:
        self.is_open = False


def test_one_card_plays_the_sum_and_all_hear_the_same() -> None:
    card = TapeCard()

    async def talk() -> list[list[Samples]]:
        medium = SharedCard(lambda: card)
        await medium.open()
        await medium.open()
        blocks = [np.full(BLOCK, level, np.float32) for level in (0.25, 0.5)]
        medium.say(np.full(BLOCK, 0.125, np.float32))
        heard = [await medium.exchange(blocks, []) for _ in range(3)]
        await medium.close()
        return heard

    heard = asyncio.run(talk())
    assert [block[0] for both in heard for block in both] == [0.0, 0.0, 0.125, 0.125, 0.25, 0.25]
    assert [block[0] for block in card.played] == [0.875, 0.75]
    assert not card.is_open


def test_a_card_that_is_gone_is_opened_again() -> None:
    cards = [TapeCard(), TapeCard()]

    async def fail() -> Samples:
        raise DeviceError("pulled out")

    cards[0].read = fail  # type: ignore[method-assign]

    async def talk() -> float:
        medium = SharedCard(iter(cards).__next__)
        await medium.open()
        with pytest.raises(DeviceError):
            await medium.exchange([np.zeros(BLOCK, np.float32)], [])
        await medium.open()
        return float((await medium.exchange([np.zeros(BLOCK, np.float32)], []))[0][0])

    assert asyncio.run(talk()) == 0.0
    assert not cards[0].is_open


def test_who_leaves_holds_nobody_up(tmp_path: Path) -> None:
    with ExitStack() as stack:
        bodies = [stack.enter_context(Body(Pose(float(k), 0.0), k)) for k in range(2)]
        room = SharedRoom(bodies)

        async def live() -> int:
            first, second = room.streams
            waiting = asyncio.ensure_future(first.read())
            await asyncio.sleep(0)
            assert not waiting.done()
            await second.close()
            return len(await waiting)

        assert asyncio.run(live()) == BLOCK


def test_without_a_sound_card_robots_talk_through_simulated_air() -> None:
    options = make_parser().parse_args(["duet", "--pipe"])
    medium, where = choose_medium(options, 2)
    assert isinstance(medium, SimulatedAir)
    assert where == "through simulated air (--pipe)"


@pytest.mark.parametrize("wrong", [["--as", "Rob,Bot"], ["--names", "Rob,rob"], ["--prt", "1"]])
def test_wrong_options_end_with_a_message(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        make_parser().parse_args(["duet", *wrong])
    assert ended.value.code == 2
    assert "hvcpctl duet" in capsys.readouterr().err
