"""`hvcpctl duet`: whole daemons in one room, somebody who types, and a card that all share."""

from __future__ import annotations

import asyncio
import io
import os
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TextIO

import numpy as np
import pytest
import structlog

from hil_fakes.body import Body
from hil_fakes.room import Air, Room
from hil_fakes.shared_card import SharedCard
from hil_fakes.shared_room import BLOCK, OWN_PAUSE_S, PATIENCE_S, PAUSE_S, SharedRoom, SimulatedAir, Voice
from hvcpd.config.settings import AudioSettings
from hvcpd.config.settings_file import load_settings
from hvcpd.control.cli import main, make_parser
from hvcpd.control.duet.cast import VISITOR, cast_of, rereading_of
from hvcpd.control.duet.duet import SLOW_S, Duet, SlowAir, cancel_once, choose_medium
from hvcpd.control.duet.onlookers import UNHEARD, Visitor
from hvcpd.control.duet.rendering import Rendering, is_rendered
from hvcpd.coordination.states import State
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import ConfigError, DeviceError, HvcpdError, PhraseError
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.ports import SAMPLE_RATE_HZ, Pose, Samples

BLOCK_S = BLOCK / SAMPLE_RATE_HZ
STOP_S = 21.0
"""When nobody speaks: both have greeted, and nobody has a task yet."""


class OverError(HvcpdError):
    """The test has seen enough."""


@pytest.fixture(autouse=True, scope="module")
def log_as_before() -> Iterator[None]:
    """A duet logs warnings only, also for the tests of other modules that come after it."""
    yield
    structlog.reset_defaults()


def wiring(folder: Path, units: Path, name: str, place: int) -> Wiring:
    state = folder / name
    state.mkdir()
    (state / "units").symlink_to(units)
    given = {"name": name, "names": ["Rob", "Bot"], "state_dir": str(state), "seed": 3}
    given |= {"start.x_m": place - 5.0, "control.socket": str(folder / f"{name}.sock")}
    return wire_up(load_settings(None, given, system_path=folder / "none.yaml"))


@pytest.mark.slow
def test_at_the_first_start_words_are_rendered_elsewhere_and_none_by_the_daemons(tmp_path: Path, units: Path) -> None:
    """Of a cache that lacks every twentieth word, as if the first start had been interrupted."""
    whole = [wiring(tmp_path, units, name, place) for place, name in enumerate(("Rob", "Bot"))]
    if not all(map(is_rendered, whole)):
        rendered(whole)  # for all tests of this run
    some = tmp_path / "some"
    some.mkdir()
    kept = sorted(path for path in units.glob("*.unit"))
    for path in (path for k, path in enumerate(kept) if k % 20):
        (some / path.name).symlink_to(path)
    (tmp_path / "first").mkdir()
    wirings = [wiring(tmp_path / "first", some, name, place) for place, name in enumerate(("Rob", "Bot"))]
    assert not any(map(is_rendered, wirings))
    rendered(wirings)
    assert all(map(is_rendered, wirings))
    before = set(some.iterdir())

    def watch(now_s: float) -> None:
        if now_s >= 1.0:
            raise OverError("the test has seen enough")

    with ExitStack() as stack:
        bodies = [stack.enter_context(Body(w.settings.start.pose, k)) for k, w in enumerate(wirings)]
        room = SharedRoom(bodies, watch)
        both = Duet(wirings, room, Visitor(VISITOR, wirings[0], lambda *_: lambda: True), io.StringIO())
        for stream, daemon in zip(room.streams, both.daemons, strict=True):
            stream.settled = daemon.settled  # all that they render, they render before the first block
        with (tmp_path / "nothing").open("w+") as typed, pytest.raises(OverError):
            asyncio.run(both.live(typed))
    assert set(some.iterdir()) == before


def rendered(wirings: list[Wiring]) -> None:
    """Render all words for them."""
    others = Rendering(wirings, niceness=0)
    try:
        others.wait()
        asyncio.run(others.ended())
    finally:
        others.end()


def test_without_a_home_that_can_be_written_words_last_as_long_as_the_duet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "home").write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    options = make_parser().parse_args(["duet", "--pipe"])
    rereading_of(options, cast_of(options), tmp_path, "Rob", 0)
    assert (tmp_path / "rob").is_dir()
    assert not (tmp_path / "rob" / "units").is_symlink()


def test_its_robots_take_tasks_that_change(tmp_path: Path) -> None:
    """`hvcpctl reload`, `task add` and `config --running` work as with any robot."""
    tasks = tmp_path / "tasks.yaml"
    one = "tasks:\n- {number: 1, name: fetch the ball, actions: [{wait: 1}]}\n"
    tasks.write_text(one)
    options = make_parser().parse_args(["duet", "--pipe", "--tasks", str(tasks)])
    rereading = rereading_of(options, cast_of(options), tmp_path, "Rob", 0)
    assert {each.key: each.value for each in rereading.sources}["tasks"] == str(tasks)
    assert len(rereading.read(None)[1].tasks.tasks) == 1
    tasks.write_text(one + "- {number: 2, name: guard the door, actions: [{wait: 1}]}\n")
    wiring = rereading.read(None)[1]
    assert len(wiring.tasks.tasks) == 2
    visitor = Visitor(
        VISITOR, rereading_of(options, cast_of(options), tmp_path, "Bot", 1).read(None)[1], lambda *_: lambda: True
    )
    tasks.write_text(one.replace("fetch the ball", "sweep the floor"))
    with pytest.raises(PhraseError):
        visitor.say("Hi Rob, I am Anna, sweep the floor")
    visitor.wiring = rereading.read(None)[1]
    assert visitor.say("Hi Rob, I am Anna, sweep the floor").line == "Anna: Hi Rob, I am Anna, sweep the floor"


def visitor_of(tmp_path: Path) -> tuple[Visitor, list[tuple[Samples, bool]]]:
    """A visitor, and what she has had played: each sound, and whether at once."""
    options = make_parser().parse_args(["duet", "--pipe"])
    played: list[tuple[Samples, bool]] = []

    def play(sound: Samples, at_once: bool) -> Callable[[], bool]:
        played.append((sound, at_once))
        return lambda: True

    return Visitor(VISITOR, rereading_of(options, cast_of(options), tmp_path, "Rob", 0).read(None)[1], play), played


def test_a_visitor_need_not_type_her_name(tmp_path: Path) -> None:
    """ "Rob, water the yellow rose" and "Rob, confirmed" were refused, although everybody may say them."""
    visitor, played = visitor_of(tmp_path)
    for text in ("Rob, please water the yellow rose", "Hi Rob, I am Anna, water the yellow rose"):
        visitor.say(text).again()
    assert np.array_equal(*(sound for sound, _ in played))


def test_an_arrow_pressed_before_a_sentence_is_no_part_of_it(tmp_path: Path) -> None:
    """ "Stop" after an arrow key was refused."""
    visitor, _ = visitor_of(tmp_path)
    for typed in ("\x1b[Astop", "\x1bOBstop\x07", "\x1b[1;5Dst\x1b[3~op"):
        assert visitor.say(typed).line == "Anna: stop"


def test_no_line_with_stop_is_refused_and_each_is_said_at_once(tmp_path: Path) -> None:
    """ "Stop stop" and "stop now" were refused, and "stop" waited for a pause, and behind what was typed before."""
    visitor, played = visitor_of(tmp_path)
    for typed in (
        "stop",
        "stop stop",
        "STOP!!!",
        "stop now",
        "Rob, stop it",
        "no, stop",
        "stopp stop",
        "Rob, halt now",
    ):
        called = visitor.say(typed)
        called.again()
        assert called.line == ("Anna: STOP!!!" if typed == "STOP!!!" else "Anna: stop")
        assert called.concerns("Bot")
        assert not called.may_wait
    visitor.say("Bot, stop").again()
    assert all(at_once for _, at_once in played)
    assert visitor.say("what is left").may_wait
    assert not visitor.say("resume").may_wait, "after a stop that was typed later it would undo that"
    visitor.say("resume").again()
    assert not played[-1][1]
    for typed in ("stopp", "the stopover", "I have stopped"):
        with pytest.raises(PhraseError):
            visitor.say(typed)


def test_who_waits_for_a_process_that_cannot_render_is_told(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    lost = wiring(tmp_path, tmp_path, "Rob", 0)
    gone = replace(lost, settings=replace(lost.settings, tasks=tmp_path / "none.yaml"))
    others = Rendering([gone])
    with pytest.raises(DeviceError, match="could not be rendered"):
        others.wait()
    others.end()
    assert "none.yaml" in capfd.readouterr().err


@contextmanager
def duet(
    folder: Path, units: Path, watch: Callable[[float], None], out: TextIO | None = None
) -> Iterator[tuple[Duet, SharedRoom, TextIO]]:
    """Rob and Bot in virtual time, and what the terminal shows, if it is not another `out`."""
    wirings = [wiring(folder, units, name, place) for place, name in enumerate(("Rob", "Bot"))]
    with ExitStack() as stack:
        bodies = [stack.enter_context(Body(w.settings.start.pose, k)) for k, w in enumerate(wirings)]
        medium = SimulatedAir(Room(2, Air(), seed=0))
        plays = SharedRoom(bodies, watch, medium=medium)
        out = out or io.StringIO()
        yield (
            Duet(wirings, plays, Visitor(VISITOR, wirings[0], medium.visitor.say), out, ready="All listen\n"),
            plays,
            out,
        )


@pytest.mark.slow
def test_robots_talk_and_obey_who_types(tmp_path: Path, units: Path) -> None:
    """From the first claim to a typed "stop"; who types something else is told what may be said."""
    script = {0.5: "what is left", 1.0: "this is no sentence", STOP_S: "bot stop"}

    def watch(now_s: float) -> None:
        if script and now_s >= min(script):
            both.say(script.pop(min(script)))
        if now_s >= STOP_S + 24.0:  # the call is said over a robot's sentence, so its answer waits for the floor
            raise OverError("the test has seen enough")

    with duet(tmp_path, units, watch) as (both, room, out):
        for stream, daemon in zip(room.streams, both.daemons, strict=True):
            stream.settled = daemon.settled
        with (tmp_path / "nothing").open("w+") as typed, pytest.raises(OverError):
            asyncio.run(both.live(typed))
        assert both.daemons[1].robot is not None
        assert both.daemons[1].robot.coordination.state is State.STOPPED
    assert isinstance(out, io.StringIO)
    assert out.getvalue().count("All listen\n") == 1
    assert "'this' is not in the phrasebook" in out.getvalue()
    assert "I will complete task" in out.getvalue()
    assert "I have stopped" in out.getvalue()
    assert "Anna: bot stop\n" in out.getvalue()
    assert re.search(r"I am (Rob|Bot), task .* left\n", out.getvalue()), "asked before any robot had spoken"
    assert UNHEARD not in out.getvalue()


@pytest.mark.slow
def test_the_lines_of_a_file_are_said_too(tmp_path: Path, units: Path) -> None:
    """A script in a pipe was said; `hvcpctl duet < script` was silent, without a word of why."""

    def watch(now_s: float) -> None:
        if now_s >= 2.0:
            raise OverError("the test has seen enough")

    (tmp_path / "script").write_text("what is left\nstop\nBot, come back")
    with duet(tmp_path, units, watch) as (both, room, out), (tmp_path / "script").open() as typed:
        for stream, daemon in zip(room.streams, both.daemons, strict=True):
            stream.settled = daemon.settled
        with pytest.raises(OverError):
            asyncio.run(both.live(typed))
    assert isinstance(out, io.StringIO)
    said = [line.partition("Anna: ")[2] for line in out.getvalue().splitlines() if "Anna: " in line]
    assert said == ["what is left", "stop", "Bot, come back"]


@pytest.mark.slow
def test_a_terminal_that_is_closed_ends_it_in_order(tmp_path: Path, units: Path) -> None:
    """A hangup killed it, and its folder and those of its motors stayed in /tmp."""

    def watch(now_s: float) -> None:
        if round(now_s / BLOCK_S) == round(1.0 / BLOCK_S):
            os.kill(os.getpid(), signal.SIGHUP)
        if now_s >= 3.0:
            raise OverError("it lives on")

    before = signal.signal(signal.SIGHUP, lambda *_: None)  # not to end the tests
    try:
        with duet(tmp_path, units, watch) as (both, room, _), (tmp_path / "nothing").open("w+") as typed:
            for stream, daemon in zip(room.streams, both.daemons, strict=True):
                stream.settled = daemon.settled
            asyncio.run(both.live(typed))
    finally:
        signal.signal(signal.SIGHUP, before)
    assert not any(daemon.robot is None for daemon in both.daemons), "they had not begun"
    assert room.now_s < 3.0


@pytest.mark.slow
def test_a_reader_that_goes_away_ends_it_in_order(tmp_path: Path, units: Path) -> None:
    """After `hvcpctl duet | head -1` it went on unseen, and SIGTERM was a traceback before it counted."""

    def watch(now_s: float) -> None:
        if now_s >= 300.0:
            raise OverError("it lives on")

    reads, writes = os.pipe()
    os.close(reads)
    gone = os.fdopen(writes, "w")
    with duet(tmp_path, units, watch, gone) as (both, room, _), (tmp_path / "nothing").open("w+") as typed:
        for stream, daemon in zip(room.streams, both.daemons, strict=True):
            stream.settled = daemon.settled
        with pytest.raises(BrokenPipeError):
            asyncio.run(both.live(typed))
    with suppress(BrokenPipeError):
        gone.close()
    assert not any(daemon.robot is None for daemon in both.daemons), "they had not begun"


async def test_robots_that_end_are_not_broken_off() -> None:
    """Of two, the second to end was: its threads made their folder in /tmp anew, and left it there."""
    ended: list[str] = []

    async def robot(name: str, rounds: int) -> None:
        try:
            await asyncio.Event().wait()  # until it is cancelled
        finally:
            for _ in range(rounds):
                await asyncio.sleep(0.0)
            ended.append(name)

    lives = [asyncio.ensure_future(robot("Rob", 1)), asyncio.ensure_future(robot("Bot", 9))]
    await asyncio.sleep(0.0)
    cancel_once(lives)
    await asyncio.wait(lives, return_when=asyncio.FIRST_COMPLETED)
    cancel_once(lives)
    await asyncio.gather(*lives, return_exceptions=True)
    assert ended == ["Rob", "Bot"]


def block(level: float) -> Samples:
    return np.full(BLOCK, level, np.float32)


def test_a_visitor_waits_for_a_pause_says_it_as_a_whole_and_interrupts_in_the_end() -> None:
    voice, blocks_s = Voice(), BLOCK / SAMPLE_RATE_HZ
    is_said = voice.say(np.full(2 * BLOCK, 0.5, np.float32))
    assert not any(voice.take([block(0.0), block(0.1)]).any() for _ in range(4)), "a robot speaks"
    quiet = round(PAUSE_S / blocks_s) - 1
    assert not any(voice.take([block(0.0), block(0.0)]).any() for _ in range(quiet)), "it may only pause for breath"
    assert voice.take([block(0.0), block(0.0)]).all()
    assert not is_said()
    assert voice.take([block(0.1), block(0.0)]).all(), "a sentence that was begun goes on"
    assert is_said()
    voice.say(block(0.5))
    waited = [voice.take([block(0.1)]).any() for _ in range(round(PATIENCE_S / blocks_s))]
    assert waited.count(True) == 1
    assert waited[-1]


def test_a_call_waits_for_no_voice_and_replaces_what_the_visitor_was_saying_or_was_to_say() -> None:
    """A "resume" that was typed before came after it, and released the robots."""
    voice, robot = Voice(), block(0.1)
    voice.say(np.full(4 * BLOCK, 0.5, np.float32), at_once=True)
    assert voice.take([robot]).all(), "a robot speaks"
    sentences = [voice.say(block(0.25)) for _ in range(3)]
    is_called = voice.say(block(0.75), at_once=True)
    assert all(is_over() for is_over in sentences)
    said = [float(voice.take([robot])[0]) for _ in range(round(PATIENCE_S / BLOCK_S) + 1)]
    assert is_called()
    assert [level for level in said if level] == [0.75]
    assert said.index(0.75) == round(PAUSE_S / BLOCK_S), "after words of her own it is heard if there is a pause"


def test_a_visitor_pauses_between_sentences_of_her_own() -> None:
    """They followed each other at once, and robots understood neither most of them nor a "stop" in their middle."""
    voice = Voice()
    for _ in range(2):
        voice.say(block(0.5))
    said = [voice.take([block(0.0)]).any() for _ in range(round(2.0 * SAMPLE_RATE_HZ / BLOCK))]
    first, second = (k for k, speaks in enumerate(said) if speaks)
    assert (second - first) * BLOCK >= OWN_PAUSE_S * SAMPLE_RATE_HZ


def test_air_that_falls_behind_real_time_is_slow_until_it_keeps_up() -> None:
    air = SlowAir(100.0, 0.0)
    assert not air.look(100.0 + SLOW_S / 2, 0.0)
    assert air.look(100.0 + SLOW_S, 0.7 * SLOW_S)
    assert not air.look(100.0 + 2 * SLOW_S, 1.7 * SLOW_S)


def test_one_robot_alone_cannot_talk_through_simulated_air() -> None:
    options = make_parser().parse_args(["duet", "--as", "Rob", "--pipe"])
    with pytest.raises(ConfigError, match="--as needs a sound card"):
        choose_medium(options, 1, AudioSettings())


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
        medium.visitor.say(np.full(2 * BLOCK, 0.125, np.float32))
        quiet = round(PAUSE_S * SAMPLE_RATE_HZ / BLOCK)
        heard = [await medium.exchange([block(0.0), block(0.0)], []) for _ in range(quiet + 1)]
        heard += [await medium.exchange([block(0.25), block(0.5)], []) for _ in range(2)]
        await medium.close()
        return heard

    heard = asyncio.run(talk())
    assert [rob[0] for rob, _ in heard] == [bot[0] for _, bot in heard] == [0.125 * k for k in range(len(heard))]
    assert [each[0] for each in card.played[-3:]] == [0.125, 0.875, 0.75]
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
    medium, where = choose_medium(options, 2, AudioSettings())
    assert isinstance(medium, SimulatedAir)
    assert where == "through simulated air (--pipe)"


def test_devices_are_those_of_the_settings_or_of_the_options(tmp_path: Path) -> None:
    """Those of the settings were ignored, and with --pipe those of the options."""
    config = tmp_path / "hvcpd.yaml"
    config.write_text("audio: {input_device: robot, output_device: horn}\n")
    options = make_parser().parse_args(["duet", "--config", str(config), "--output-device", "other"])
    audio = rereading_of(options, cast_of(options), tmp_path, "Rob", 0).load().settings.audio
    assert (audio.input_device, audio.output_device) == ("robot", "other")
    options = make_parser().parse_args(["duet", "--pipe", "--input-device", "robot"])
    with pytest.raises(ConfigError, match="simulated air has no devices"):
        choose_medium(options, 2, audio)


def test_a_device_that_was_named_and_is_not_there_is_told() -> None:
    """The robots talked through simulated air, and nobody heard the loudspeaker that was meant."""
    options = make_parser().parse_args(["duet", "--output-device", "no such device"])
    with pytest.raises(DeviceError, match=r"there is no (microphone|loudspeaker)"):
        choose_medium(options, 2, AudioSettings(output_device="no such device"))


@pytest.mark.parametrize(
    ("names", "why"),
    [("Kim,Tina", "'Kim' sounds like the phrasebook's word 'team'"), ("Nca,Nka", "'Nca' and 'Nka' sound the same")],
)
def test_names_that_robots_would_confuse_are_refused(names: str, why: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Only here they were accepted."""
    assert main(["duet", "--pipe", "--no-console", "--names", names]) == 2
    assert why in capsys.readouterr().err


@pytest.mark.parametrize("wrong", [["--as", "Rob,Bot"], ["--names", "Rob,rob"], ["--prt", "1"]])
def test_wrong_options_end_with_a_message(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        make_parser().parse_args(["duet", *wrong])
    assert ended.value.code == 2
    assert "hvcpctl duet" in capsys.readouterr().err
