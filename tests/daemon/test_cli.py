"""The command line of `hvcpd`: what it says and how it exits, without a device of this machine."""

from __future__ import annotations

import signal
import threading
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hvcpd import __version__
from hvcpd.cli import main
from hvcpd.config.settings_file import load_settings
from hvcpd.daemon.devices import Devices
from hvcpd.daemon.main_loop import FAREWELL_S
from hvcpd.errors import (
    EX_CANTCREAT,
    EX_CONFIG,
    EX_INTERRUPTED,
    EX_OK,
    EX_SOFTWARE,
    EX_UNAVAILABLE,
    EX_USAGE,
    DeviceError,
)
from hvcpd.hardware.audio_stream import AudioStream
from hvcpd.ports import Samples
from tests.daemon.virtual import TwoCards, devices_of, shared_room
from tests.hardware.fake_card import HEADSET, FakeCard

pytestmark = pytest.mark.slow


class NoCards(TwoCards):
    def query_devices(self, device: object = None, kind: str | None = None) -> object:
        if kind is not None:
            raise self.PortAudioError("no default")
        return []


@pytest.fixture
def known(config: Path, units: Path, compared: Path) -> Path:
    """Settings with a state directory of a robot that has been started before."""
    (config.parent / "state").mkdir()
    (config.parent / "state" / "units").symlink_to(units)
    (config.parent / "state" / "vocabulary").symlink_to(compared)
    return config


@pytest.fixture
def ready(known: Path) -> Path:
    """The same, with a port that is there."""
    known.write_text(known.read_text().replace(str(known.parent / "no-such-port"), "/dev/null"))
    return known


def never(*_: Any) -> Any:
    raise AssertionError("a device was opened although one is missing")


MISSING = Devices(NoCards, never, never)


def no_library() -> Any:
    raise DeviceError("the PortAudio library is missing (libportaudio.so.2); `apt install libportaudio2`")


def interrupted() -> Any:
    raise KeyboardInterrupt


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "hvcpd.yaml"
    path.write_text(f"state_dir: {tmp_path / 'state'}\nwheels: {{port: {tmp_path / 'no-such-port'}}}\nseed: 1\n")
    return path


def test_all_that_is_missing_is_told_at_once_and_nothing_is_opened(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--config", str(config), "--name", "Rob"], MISSING) == EX_UNAVAILABLE
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert len(lines) == 3
    assert all(line.startswith("hvcpd: ") for line in lines)
    assert "no microphone" in lines[0]
    assert "arecord -l" in lines[0]
    assert "no loudspeaker" in lines[1]
    assert "wheels.port" in lines[2]
    assert "no-such-port" in lines[2]
    assert not (config.parent / "state").exists()


def test_check_says_what_is_there(config: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config.write_text(config.read_text().replace("wheels: {", "wheels: {driver: none, "))
    assert main(["--config", str(config), "--name", "Rob", "--check"], Devices(TwoCards, never, never)) == EX_OK
    out, err = capsys.readouterr()
    assert err == ""
    subjects = [line.split(":")[0] for line in out.splitlines()]
    assert subjects == ["ok  tasks", "ok  vocabulary", "ok  memory", "ok  microphone", "ok  loudspeaker", "ok  wheels"]
    assert not (config.parent / "state").exists()


def test_check_warns_of_what_may_not_be_meant(known: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tasks = known.parent / "tasks.yaml"
    tasks.write_text("tasks: [{number: 1, name: water the green rose, place: {x_m: 1, y_m: 2}, actions: [water: 5]}]\n")
    known.write_text(known.read_text().replace("wheels: {", "wheels: {driver: none, ") + f"tasks: {tasks}\n")
    assert main(["--config", str(known), "--name", "Rob", "--check"], Devices(TwoCards, never, never)) == EX_OK
    out, err = capsys.readouterr()
    assert err.startswith(
        f"hvcpd: warning: {tasks}: task 1, 'water the green rose': it has a place, but no action leads"
    )
    assert "no action leads" not in out


def test_check_warns_of_enrolments_that_cannot_be_used(known: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They were told in a line of the log, before there was one, or not at all."""
    folder = known.parent / "state" / "people"
    folder.touch()
    assert main(["--config", str(known), "--name", "Rob", "--check"], MISSING) == EX_UNAVAILABLE
    out, err = capsys.readouterr()
    text = f"hvcpd: warning: {folder}: no folder, so nobody's voice is known; move it away\n"
    assert err.startswith(text)
    assert all(line.startswith("ok  ") for line in out.splitlines())
    assert main(["--config", str(known), "--name", "Rob"], MISSING) == EX_UNAVAILABLE
    assert capsys.readouterr().err.startswith(text), "at the start, too"


@pytest.mark.parametrize(
    ("key", "reason"),
    [
        ("clips: {folder: FILE}", "FILE is not a directory; set `clips.folder` to another"),
        ("clips: {folder: FILE/clips}", "FILE is not a directory; set `clips.folder` to another"),
        ("clips: {folder: LINK}", "LINK is a link to nothing; mount its disk, or set `clips.folder` to another"),
        ("control: {socket: FILE/rob.sock}", "FILE is not a directory; set `control.socket` to another"),
        ("control: {socket: FILE}", "FILE is no socket; move it away, or set `control.socket` to another"),
        ("control: {socket: LINK}", "LINK is no socket; move it away, or set `control.socket` to another"),
        ("state_dir: LONG", "LONG: File name too long; set `state_dir` to another"),
        ("clips: {folder: LONG}", "LONG: File name too long; set `clips.folder` to another"),
        ("clips: {folder: LONG/clips}", "LONG/clips: File name too long; set `clips.folder` to another"),
        ("control: {socket: LONG/rob.sock}", "LONG: File name too long; set `control.socket` to another"),
        ("control: {socket: LONG}", "LONG: File name too long; set `control.socket` to another"),
    ],
)
def test_check_warns_of_places_that_cannot_be_used(
    key: str, reason: str, known: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, link = known.parent / "file", known.parent / "link"
    file.touch()
    link.symlink_to(known.parent / "nowhere")

    def placed(text: str) -> str:
        return (
            text.replace("FILE", str(file)).replace("LINK", str(link)).replace("LONG", str(file.with_name("a" * 300)))
        )

    lines = [line for line in known.read_text().splitlines() if not line.startswith(key.split(":")[0])]
    known.write_text("\n".join((*lines, placed(key))) + "\n")
    main(["--config", str(known), "--name", "Rob", "--check"], MISSING)
    assert placed(f": {reason}\n") in capsys.readouterr().err


def test_check_tells_places_that_can_be_used(known: Path, capsys: pytest.CaptureFixture[str]) -> None:
    clips, sock = known.parent / "clips", known.parent / "run" / "rob.sock"
    known.write_text(known.read_text() + f"clips: {{folder: {clips}}}\ncontrol: {{socket: {sock}}}\n")
    main(["--config", str(known), "--name", "Rob", "--check"], MISSING)
    out = capsys.readouterr().out
    assert f"ok  clips: {clips} will be made\nok  control: {sock}, for `hvcpctl`\n" in out
    assert not clips.exists()


def test_check_warns_of_changes_of_tasks_that_cannot_be_read(known: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It ended with 78 then, and so did the daemon."""
    file = known.parent / "state" / "rob.tasks.yaml"
    file.write_text("removed: [")
    assert main(["--config", str(known), "--name", "Rob", "--check"], MISSING) == EX_UNAVAILABLE
    out, err = capsys.readouterr()
    assert err.startswith(f"hvcpd: warning: {file}:1: not valid YAML")
    assert "or the robot sets the file aside, and starts stopped" in err
    assert "ok  tasks: 5 tasks" in out
    assert file.exists()


def test_check_tells_missing_and_present_apart(known: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--config", str(known), "--name", "Rob", "--check"], MISSING) == EX_UNAVAILABLE
    out, err = capsys.readouterr()
    assert out.count("ok  ") == 3
    assert len(err.splitlines()) == 3


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_an_output_that_cannot_be_written_changes_no_exit_status(
    known: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Path("/dev/full").open("w") as full, redirect_stdout(full):
        assert main(["--config", str(known), "--name", "Rob", "--check"], MISSING) == EX_UNAVAILABLE
    lines = capsys.readouterr().err.splitlines()
    assert "cannot be written" in lines[0]
    assert len(lines) == 4, "every fault is told all the same"


def test_closed_streams_change_no_exit_status(known: Path) -> None:
    with redirect_stdout(None), redirect_stderr(None):
        assert main(["--config", str(known), "--name", "Rob", "--check"], MISSING) == EX_UNAVAILABLE


def test_an_interrupt_before_it_began_is_no_traceback(known: Path) -> None:
    assert main(["--config", str(known), "--name", "Rob"], Devices(interrupted, never, never)) == EX_INTERRUPTED


def test_a_missing_library_is_one_line(known: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--config", str(known), "--name", "Rob"], Devices(no_library, never, never)) == EX_UNAVAILABLE
    assert capsys.readouterr().err.count("libportaudio2") == 1


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("colour: red\n", "unknown key 'colour'"),
        ("name: [Rob]\n", "expected text, found a list"),
        ("name: Hello\n", "'hello'"),
        ("name: Ann\n", "sounds like the phrasebook's word 'am'"),
        ("name: Rob\nmode: boss\n", "not one of the choices"),
        ("name: Rob\ntasks: nowhere.yaml\n", "no such file"),
        ("name: Rob\nlexicon: nowhere.txt\n", "nowhere.txt: there is no such file"),
        ("name: Rob\nteam: rob\nteams: [bot]\nnames: [Team]\n", "sounds like the phrasebook's word 'team'"),
        ("- a\n- b\n", "expected a group of keys"),
        ("name: Rob\n\tteam: x\n", ":2: not valid YAML"),
    ],
)
def test_faults_of_the_configuration(text: str, part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "hvcpd.yaml"
    path.write_text(text)
    status = main(["--config", str(path)], Devices(TwoCards, never, never))
    err = capsys.readouterr().err
    assert part in err
    assert "Traceback" not in err
    assert status == EX_CONFIG


def test_a_fault_of_an_option_names_it_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--name", "R2-D2", "--team", "9"], MISSING) == EX_CONFIG
    name, team = capsys.readouterr().err.splitlines()
    assert name.startswith("hvcpd: --name: the name 'R2-D2' is not")
    assert team.startswith("hvcpd: --team: the team's name '9' is not")


def test_faults_of_the_tasks_and_missing_devices_together(config: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tasks = config.parent / "tasks.yaml"
    tasks.write_text("tasks:\n- {number: 1, name: water the rose, actions: [{wate: 5}]}\n")
    assert main(["--config", str(config), "--name", "Rob", "--tasks", str(tasks)], MISSING) == EX_CONFIG
    err = capsys.readouterr().err
    assert "did you mean 'water'?" in err
    assert "no microphone" in err


def test_no_name_is_told_with_the_remedy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "empty.yaml"
    path.write_text("")
    assert main(["--config", str(path)], MISSING) == EX_CONFIG
    assert "give --name NAME" in capsys.readouterr().err


def test_a_state_directory_that_is_a_file(config: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (config.parent / "state").write_text("in the way")
    assert main(["--config", str(config), "--name", "Rob"], MISSING) == EX_CANTCREAT
    assert "is not a directory" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["--nmae", "Rob"], ["--mode", "boss"], ["stray"], ["--log-level", "loud"]])
def test_wrong_usage_exits_with_64(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments, MISSING)
    assert end.value.code == EX_USAGE
    assert "--help" in capsys.readouterr().err


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--version"], MISSING)
    assert end.value.code == EX_OK
    assert capsys.readouterr().out == f"hvcpd {__version__}\n"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_in_order_with_0(
    number: signal.Signals, ready: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = load_settings(ready, {"name": "Rob"})
    asked: list[float] = []

    def watch(now: float) -> None:
        if not asked and room.streams[0].playing.any():  # it has its own words by now
            asked.append(now)
            signal.raise_signal(number)

    with shared_room([settings], watch) as room:
        assert main(["--config", str(ready), "--name", "Rob"], devices_of(room)) == EX_OK
        assert room.streams[0].log == ["open", "start", "close"]
    lines = capsys.readouterr().err.splitlines()
    assert lines[-1].endswith("level=info event=stopped")
    said = [line for line in lines if "event=said" in line]
    assert "I am leaving" in said[-1]
    played = np.concatenate(room.streams[0].played)
    assert np.abs(played[-8000:]).max() > 0.01, "the farewell was cut off"
    assert room.now_s < asked[0] + FAREWELL_S


@pytest.mark.parametrize("early", ["sound_backend", "make_stream", "make_wheels"])
def test_a_hangup_while_it_starts_ends_nothing_and_is_obeyed_once_the_robot_is_ready(
    early: str, ready: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ended the daemon as if in order, so that systemd did not start it again; or it was lost without a word."""
    settings = load_settings(ready, {"name": "Rob"})

    def watch(now: float) -> None:
        if (now >= 1.0 and "event=reloaded" in capsys.readouterr().err) or now > 10.0:
            reloaded.append(now)
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGTERM)

    def hung_up(*given: Any) -> Any:
        signal.raise_signal(signal.SIGHUP)
        return make(*given)

    reloaded: list[float] = []
    before = signal.signal(signal.SIGHUP, lambda *_: None)  # not to end the tests
    try:
        with shared_room([settings], watch) as room:
            devices = devices_of(room)
            make = getattr(devices, early)
            assert main(["--config", str(ready), "--name", "Rob"], replace(devices, **{early: hung_up})) == EX_OK
    finally:
        signal.signal(signal.SIGHUP, before)
    assert reloaded[0] < 10.0


def test_a_second_signal_ends_it_without_a_word(ready: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = load_settings(ready, {"name": "Rob"})

    def watch(now: float) -> None:
        if abs(now - 2.0) < 1e-6 or abs(now - 2.1) < 1e-6:
            signal.raise_signal(signal.SIGINT)

    with shared_room([settings], watch) as room:
        assert main(["--config", str(ready), "--name", "Rob"], devices_of(room)) == EX_OK
        assert room.streams[0].log == ["open", "start", "close"]
    assert "event=stopped" in capsys.readouterr().err
    assert room.now_s < 2.3


def test_a_farewell_that_finds_no_gap_is_given_up(ready: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Somebody who never ends speaking keeps no robot from ending."""
    settings = load_settings(ready, {"name": "Rob"})

    def watch(now: float) -> None:
        if abs(now - 2.0) < 1e-6:
            signal.raise_signal(signal.SIGTERM)

    with shared_room([settings], watch) as room:
        stream = room.streams[0]
        quiet, noise = stream.read, np.random.default_rng(1)

        async def talked_over() -> np.ndarray:
            bursts = 0.1 * (np.sin(2 * np.pi * 4.0 * room.now_s) > 0.0)  # four syllables a second
            sound = await quiet()
            return sound + (bursts * noise.standard_normal(len(sound))).astype(np.float32) * (room.now_s > 1.0)

        stream.read = talked_over  # type: ignore[method-assign]
        assert main(["--config", str(ready), "--name", "Rob"], devices_of(room)) == EX_OK
    assert "I am leaving" not in capsys.readouterr().err
    assert FAREWELL_S <= room.now_s - 2.0 < FAREWELL_S + 0.2


def test_a_dead_card_ends_nothing_and_a_signal_still_does(ready: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = load_settings(ready, {"name": "Rob"})

    def watch(now: float) -> None:
        if now >= 1.0:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGTERM)
            raise DeviceError("the sound card 'mic' stopped; is it still connected?")

    with shared_room([settings], watch) as room:
        assert main(["--config", str(ready), "--name", "Rob"], devices_of(room)) == EX_OK
        assert room.streams[0].log == ["open", "start", "close", "close"]
    lines = capsys.readouterr().err.splitlines()
    assert any('level=error event="sound failed"' in line and "still connected" in line for line in lines)
    assert "event=stopped" in lines[-1]


def test_our_own_fault_exits_with_70_after_the_wheels_are_stopped(
    ready: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = load_settings(ready, {"name": "Rob"})

    def watch(now: float) -> None:
        if now >= 1.0:
            raise ZeroDivisionError("a fault of ours")

    with shared_room([settings], watch) as room:
        assert main(["--config", str(ready), "--name", "Rob"], devices_of(room)) == EX_SOFTWARE
        assert room.streams[0].log[-1] == "close"
    last = capsys.readouterr().err.splitlines()[-1]
    assert "event=crashed" in last
    assert "ZeroDivisionError: a fault of ours" in last


def test_the_real_stream_on_a_card_that_is_pulled_out_and_put_back(
    ready: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """AudioStream, its card on another thread, and the daemon's loop together."""
    ready.write_text(ready.read_text().replace("wheels: {", "wheels: {driver: none, "))
    card = FakeCard((HEADSET,))

    def interrupts() -> None:
        card.running(300.0)
        for _ in range(200):
            card.interrupt(np.zeros(400, np.float32))
        card.die()
        card.running(300.0, streams=2)
        card.interrupt(np.zeros(400, np.float32))

    class Ending(AudioStream):
        """Two signals come when the robot speaks, or keeps silent, on the second stream."""

        def write(self, samples: Samples) -> None:
            super().write(samples)
            if card.listed_afresh:
                signal.raise_signal(signal.SIGINT)
                signal.raise_signal(signal.SIGINT)

    thread = threading.Thread(target=interrupts)
    thread.start()
    devices = Devices(lambda: card, lambda settings: Ending(settings, card))
    assert main(["--config", str(ready), "--name", "Rob"], devices) == EX_OK
    thread.join()
    err = capsys.readouterr().err
    assert "latency_s=0.12" in err
    assert "is it still connected, does the sound server run?" in err
    assert "sound is back" in err
    assert card.listed_afresh == 1
    assert card.inputs[-1].closed
    assert card.outputs[-1].closed
