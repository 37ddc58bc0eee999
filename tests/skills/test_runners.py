"""Programs, pins and Python objects carry calls out; cancelled, hung or killed, they leave all safe."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from hil_fakes.pins import FilePins, is_on
from hil_fakes.sound_server import wait_until
from hvcpd.config.skill_settings import PinSettings
from hvcpd.control.live.skills import until_ended
from hvcpd.errors import DeviceError
from hvcpd.skills.life import Call
from hvcpd.skills.objects import PythonRunner
from hvcpd.skills.pins import PinRunner
from hvcpd.skills.runners import FailedError, ProgramRunner, Runner
from tests.skills.virtual_loop import pass_time, run_virtually

STOP_S = 0.5
"""From a cancel to the safe state, at the most."""

STOPPED = "TD"
"""States in /proc/PID/stat: stopped, or waiting for a child that was stopped before its exec (vfork)."""

EXAMPLE = Path(__file__).with_name("example_skill.py")


def call(**arguments: float | str) -> Call:
    return Call(1, 3, "pour", tuple(arguments.items()), 20.0)


def shell(text: str, *more: str) -> ProgramRunner:
    """A program, which happens to be a shell here; what follows are its arguments."""
    return ProgramRunner(("sh", "-c", text, "sh", *more))


def perform(runner: Runner, what: Call | None = None) -> tuple[dict[str, Any], list[tuple[float | None, str]]]:
    told: list[tuple[float | None, str]] = []

    async def scene() -> dict[str, Any]:
        try:
            return dict(await runner.perform(what or call(), lambda share, text: told.append((share, text))))
        finally:
            await runner.close()

    return run(scene()), told


def run(scene: Coroutine[Any, Any, Any]) -> Any:
    return asyncio.run(asyncio.wait_for(scene, 20.0))


async def met(true: Callable[[], bool], what: str) -> None:
    """Wait for another process."""
    await asyncio.to_thread(wait_until, true, 10.0, what)


async def cancelled(runner: Runner, begun: Callable[[], bool], what: Call | None = None) -> float:
    """Cancel a call once it has begun; how long it took until all was safe, s."""
    task = asyncio.create_task(runner.perform(what or call(), lambda _share, _text: None))  # type: ignore[arg-type]
    while not begun():
        assert not task.done(), task
        await asyncio.sleep(0)
    began_s = time.monotonic()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    return time.monotonic() - began_s


def left_of(group: int) -> list[str]:
    """The processes of a group that still run; who is dead and was not yet fetched by its parent does not."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _parent, its_group = path.read_text().rpartition(")")[2].split()[:3]
            found += [path.parent.name] if int(its_group) == group and state not in "ZX" else []
    return found


def program_of(pid: Path) -> int | None:
    """The process that a program wrote down, once it has."""
    return int(pid.read_text()) if pid.exists() and pid.read_text() else None


def until_gone(group: int) -> None:
    """Who was sent SIGKILL runs no further, but is there until a busy kernel gives it its turn to die."""
    wait_until(lambda: left_of(group) == [], 5.0, "the group is gone")


def test_a_program_tells_how_far_it_is_and_what_came_of_it() -> None:
    half, litres = '{"progress": 0.5, "text": "half"}', '{"results": {"litres": 0.4}}'
    assert perform(shell(f"echo '{half}'; echo noise; echo '{litres}'")) == ({"litres": 0.4}, [(0.5, "half")])


def test_arguments_stand_in_its_words_and_no_shell_reads_them() -> None:
    echo = "import sys, json; print(json.dumps({'results': {'a': sys.argv[1:]}}))"
    program = ProgramRunner((sys.executable, "-c", echo, "{litres}", "to {what}"))
    found, _ = perform(program, call(litres=0.25, what="$(reboot); 'x' {litres}"))
    assert found == {"a": ["0.25", "to $(reboot); 'x' {litres}"]}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('echo "{\\"reason\\": \\"the tank is empty\\"}"; exit 3', "the tank is empty"),
        ("exit 4", "exit status 4"),
        ("kill -9 $$", "ended by signal 9"),
    ],
)
def test_its_exit_status_decides_and_it_may_say_why(text: str, reason: str) -> None:
    with pytest.raises(FailedError, match=reason):
        perform(shell(text))


def test_what_is_no_json_or_endless_is_passed_over() -> None:
    text = "head -c 100000 /dev/zero | tr '\\0' x; echo; echo '[1]'; "
    text += """echo '{"progress": 7}'; echo '{"progress": true}'"""
    assert perform(shell(text)) == ({}, [(None, ""), (None, "")])


def test_a_missing_program_is_a_failed_call() -> None:
    with pytest.raises(FailedError, match="/no/such: No such file or directory"):
        perform(ProgramRunner(("/no/such",)))


@pytest.mark.parametrize("deaf", [False, True])
def test_a_program_that_is_cancelled_is_gone_with_all_that_it_started(deaf: bool, tmp_path: Path) -> None:
    trap = "trap '' TERM; " if deaf else ""
    text = f"{trap}echo $$ > {tmp_path}/pid.new; sleep 60 & mv {tmp_path}/pid.new {tmp_path}/pid; wait; wait; sleep 60"
    took_s = run(cancelled(shell(text), (tmp_path / "pid").exists))
    assert took_s < STOP_S
    until_gone(int((tmp_path / "pid").read_text()))


def test_a_cancel_that_comes_before_a_program_is_known_to_run_ends_it_too(tmp_path: Path) -> None:
    """What it had started lived on, and nothing was left safe: a cancel ended the waiting for it to be started."""
    pid, safe = tmp_path / "pid", tmp_path / "safe"
    program = ProgramRunner(("sh", "-c", f"sleep 60 & echo $$ > {pid}; wait"), ("touch", str(safe)))

    async def scene() -> None:
        task = asyncio.create_task(program.perform(call(), lambda _share, _text: None))  # type: ignore[arg-type]
        while program_of(pid) is None:
            await asyncio.sleep(0)  # one step of the loop, and as long for the program as it needs
            with suppress(TimeoutError):
                wait_until(lambda: program_of(pid) is not None, 0.1, "it runs")
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    run(scene())
    assert safe.exists()
    until_gone(int(pid.read_text()))


def test_the_program_that_leaves_all_safe_is_run_after_a_bad_end_only(tmp_path: Path) -> None:
    safe = ("touch", f"{tmp_path}/safe")
    with pytest.raises(FailedError):
        perform(ProgramRunner(("false",), safe))
    assert (tmp_path / "safe").exists()
    (tmp_path / "safe").unlink()
    run(cancelled(ProgramRunner(("sh", "-c", f"touch {tmp_path}/begun; sleep 60"), safe), (tmp_path / "begun").exists))
    assert (tmp_path / "safe").exists()
    (tmp_path / "safe").unlink()
    perform(ProgramRunner(("true",), safe))
    assert not (tmp_path / "safe").exists()


def test_a_program_that_is_held_stands_still(tmp_path: Path) -> None:
    """The kernel says that it is stopped while it is held; let go, it counts on."""
    program = shell('while :; do echo "{\\"progress\\": 0.5, \\"text\\": \\"$$\\"}"; sleep 0.01; done')

    async def scene() -> None:
        beats = asyncio.Queue[str]()
        task = asyncio.create_task(program.perform(call(), lambda _share, text: beats.put_nowait(text)))  # type: ignore[arg-type]
        stat = Path(f"/proc/{await beats.get()}/stat")
        program.hold(True)
        await met(lambda: stat.read_text().rpartition(") ")[2][0] in STOPPED, "the program is stopped")
        program.hold(False)
        while not beats.empty():
            beats.get_nowait()
        for _ in range(3):
            await beats.get()
        task.cancel()
        await asyncio.wait([task])

    run(scene())


class Pins:
    """Pins in memory, and how long one was on by the loop's virtual time."""

    def __init__(self) -> None:
        from gpiozero.pins.mock import MockFactory

        self.factory = MockFactory()

    def is_on(self, number: int = 17) -> bool:
        return bool(self.factory.pin(number).state)

    async def time_on(self, limit_s: float) -> float:
        on_s = 0.0
        for _ in range(round(limit_s / 0.01)):
            on_s += 0.01 * self.is_on()
            await pass_time(0.01)
        return on_s


def test_a_pin_is_on_for_as_long_as_it_is_told() -> None:
    pins = Pins()

    async def scene() -> None:
        pin = PinRunner(PinSettings(17, "litres", per_s=0.05), pins.factory)
        assert not pins.is_on()
        told: list[float | None] = []
        task = asyncio.create_task(pin.perform(call(litres=0.1), lambda share, _text: told.append(share)))  # type: ignore[arg-type]
        assert await pins.time_on(5.0) == pytest.approx(2.0, abs=0.03)
        assert dict(await task) == {"litres": 0.1}
        assert told == pytest.approx([0.25, 0.5, 0.75, 1.0])
        await pin.close()

    run_virtually(scene())


def test_a_pin_that_is_cancelled_is_off_at_once_and_a_held_one_keeps_its_time() -> None:
    pins = Pins()

    async def scene() -> None:
        pin = PinRunner(PinSettings(17), pins.factory)
        assert await cancelled(pin, pins.is_on, call(seconds=60.0)) < STOP_S
        assert not pins.is_on()
        task = asyncio.create_task(pin.perform(call(seconds=3.0), lambda _share, _text: None))  # type: ignore[arg-type]
        await pass_time(1.2)
        pin.hold(True)
        assert not pins.is_on()
        await pass_time(5.0)
        assert not task.done()
        pin.hold(False)
        assert await pins.time_on(5.0) == pytest.approx(1.8, abs=0.03)
        await task
        await pin.close()

    run_virtually(scene())


def test_a_float_that_closes_ends_a_pumps_call_and_an_empty_tank_does_not_begin_one() -> None:
    pins = Pins()

    async def scene() -> None:
        pin = PinRunner(PinSettings(17, empty_pin=27), pins.factory)
        task = asyncio.create_task(pin.perform(call(seconds=60.0), lambda _share, _text: None))  # type: ignore[arg-type]
        await pass_time(1.0)
        assert pins.is_on()
        pins.factory.pin(27).drive_low()
        await pass_time(0.1)
        with pytest.raises(FailedError, match="the tank is empty"):
            await task
        assert not pins.is_on()
        with pytest.raises(FailedError, match="the tank is empty"):
            await pin.perform(call(seconds=1.0), lambda _share, _text: None)
        await pin.close()

    run_virtually(scene())


def test_a_pin_that_somebody_else_has_is_told_with_its_remedy(tmp_path: Path) -> None:
    pins = FilePins(tmp_path)

    async def scene() -> None:
        first = PinRunner(PinSettings(17), pins)
        with pytest.raises(DeviceError, match=r"pin 17 cannot be used .*; end what else uses it"):
            PinRunner(PinSettings(17), pins)
        code = "from gpiozero import LED; import signal; led = LED(4); print(1, flush=True); signal.pause()"
        words = [sys.executable, "-c", code]
        with subprocess.Popen(words, stdout=subprocess.PIPE, env=fake_pins(tmp_path)) as process:
            assert process.stdout is not None
            process.stdout.readline()
            with pytest.raises(DeviceError, match=r"pin 4 cannot be used .*busy"):
                PinRunner(PinSettings(4), pins)
            process.kill()
        await first.close()

    run(scene())


def test_a_pump_process_turns_with_its_pin_until_its_tank_is_empty(tmp_path: Path) -> None:
    pins = FilePins(tmp_path)
    words = ("--pins", str(tmp_path), "--pump", "17", "--float", "27", "--litres", "0.005")
    with subprocess.Popen([sys.executable, "-m", "hil_fakes.pump", *words], stdout=subprocess.PIPE, text=True) as pump:

        async def scene() -> None:
            await met((tmp_path / "27.level").exists, "the tank's float is there")
            pin = PinRunner(PinSettings(17, "litres", per_s=0.05, empty_pin=27), pins)
            with pytest.raises(FailedError, match="the tank is empty"):
                await pin.perform(call(litres=1.0), lambda _share, _text: None)
            await pin.close()

        run(scene())
        assert pump.stdout is not None
        told = [pump.stdout.readline(), pump.stdout.readline()]
        pump.kill()
    assert told == ["pump on, 0.000 l poured, 0.005 l left\n", "pump off, 0.005 l poured, 0.000 l left\n"]


def fake_pins(folder: Path) -> dict[str, str]:
    """The environment in which gpiozero uses pins in a folder."""
    return {**os.environ, "GPIOZERO_PIN_FACTORY": "files", "FAKE_PINS": str(folder)}


HOST = """
import asyncio, sys
from hvcpd.config.skill_settings import PinSettings
from hvcpd.skills.guard import GuardLine
from hvcpd.skills.life import Call
from hvcpd.skills.pins import PinRunner
from hvcpd.skills.runners import ProgramRunner
guard = GuardLine({17: True})
async def main():
    if sys.argv[1] == "pin":
        runner = PinRunner(PinSettings(17))
    else:
        runner = ProgramRunner(("sh", "-c", "echo $$ > $0; sleep 60", sys.argv[2]), ("touch", sys.argv[3]), guard)
    beat = asyncio.create_task(guard.beat())
    await runner.perform(Call(1, 1, "pour", (("seconds", 60.0),), 60.0), lambda share, text: None)
asyncio.run(main())
"""


def test_a_host_that_is_killed_leaves_its_pin_off(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", HOST, "pin"], env=fake_pins(tmp_path)) as host:
        wait_until(lambda: is_on(tmp_path, 17), 10.0, "the pin is on")
        host.kill()
        wait_until(lambda: not is_on(tmp_path, 17), 10.0, "the pin is off")


def test_a_pin_that_is_still_in_use_is_switched_off_once_it_is_free(tmp_path: Path) -> None:
    """Whoever was killed may hold it for a moment more."""
    code = "from gpiozero import LED; led = LED(17); led.on(); print(1, flush=True); input()"
    env = fake_pins(tmp_path)
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=env
    ) as other:
        assert other.stdout is not None
        other.stdout.readline()
        words = [sys.executable, "-m", "hvcpd.skills.guard"]
        with subprocess.Popen(words, stdin=subprocess.PIPE, env=env) as guard:
            assert guard.stdin is not None
            guard.stdin.write(b'{"pins": [[17, true]]}\n')
            guard.stdin.close()
            with pytest.raises(subprocess.TimeoutExpired):
                guard.wait(1.0)
            other.kill()
            guard.wait(10.0)
    assert not is_on(tmp_path, 17)


def test_a_host_that_is_frozen_is_ended_and_leaves_its_pin_off(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", HOST, "pin"], env=fake_pins(tmp_path)) as host:
        wait_until(lambda: is_on(tmp_path, 17), 10.0, "the pin is on")
        host.send_signal(signal.SIGSTOP)
        wait_until(lambda: not is_on(tmp_path, 17), 10.0, "the pin is off")
    assert host.returncode == -signal.SIGKILL


def test_a_host_that_is_killed_leaves_no_program_and_all_safe(tmp_path: Path) -> None:
    pid, safe = tmp_path / "pid", tmp_path / "safe"
    words = [sys.executable, "-c", HOST, "program", str(pid), str(safe)]
    with subprocess.Popen(words, env=fake_pins(tmp_path)) as host:
        wait_until(lambda: pid.exists() and pid.read_text() != "", 10.0, "the program runs")
        host.kill()
        wait_until(safe.exists, 10.0, "all is safe")
    until_gone(int(pid.read_text()))


KILLED_AT_ONCE = """
import os, signal
arm = guard.arm
guard.arm = lambda group, safe: arm(group, safe) if group is None else os.kill(os.getpid(), signal.SIGKILL)
asyncio.run"""


def test_a_host_that_is_killed_before_it_has_reported_the_program_leaves_none_either(tmp_path: Path) -> None:
    """The guard knew nothing of the program: it ran on for ever, and nothing was made safe."""
    pid, safe = tmp_path / "pid", tmp_path / "safe"
    code = HOST.replace("\nasyncio.run", KILLED_AT_ONCE)
    with subprocess.Popen(
        [sys.executable, "-c", code, "program", str(pid), str(safe)], env=fake_pins(tmp_path)
    ) as host:
        wait_until(safe.exists, 10.0, "all is safe")
    assert host.returncode == -signal.SIGKILL
    wait_until(
        lambda: not any(str(pid) in _read(each) for each in Path("/proc").glob("[0-9]*/cmdline")), 10.0, "it ends"
    )


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A Python package with a skill, as pip installs one."""
    folder = tmp_path / "site"
    (folder / "example_skill-1.0.dist-info").mkdir(parents=True)
    (folder / "example_skill-1.0.dist-info" / "METADATA").write_text("Name: example-skill\nVersion: 1.0\n")
    points = "[hvcpd.skills]\nwave = example_skill:Wave\n"
    (folder / "example_skill-1.0.dist-info" / "entry_points.txt").write_text(points)
    (folder / "example_skill.py").write_text(EXAMPLE.read_text())
    monkeypatch.setenv("PYTHONPATH", str(folder))


@pytest.mark.usefixtures("package")
def test_a_python_object_lives_on_from_call_to_call_and_one_that_hangs_is_killed() -> None:
    wave = PythonRunner("wave")

    async def scene() -> None:
        told: list[float | None] = []
        for count in (1.0, 2.0):
            results = await wave.perform(call(times=3.0), lambda share, _text: told.append(share))
            assert results == {"waves": 3.0, "calls": count}
        assert told == [1 / 3, 2 / 3, 1.0] * 2
        with pytest.raises(FailedError, match="the arm is stuck"):
            await wave.perform(call(times=-1.0), lambda _share, _text: None)
        with pytest.raises(FailedError, match="ZeroDivisionError: "):
            await wave.perform(call(times=0.0), lambda _share, _text: None)
        begun: list[float | None] = []
        for times in (1e9, -9.0):  # the second one hangs, and answers no cancel
            begun.clear()
            what = call(times=times)
            task = asyncio.create_task(wave.perform(what, lambda share, _text: begun.append(share)))  # type: ignore[arg-type]
            while not begun:
                await asyncio.sleep(0)
            began_s = time.monotonic()
            task.cancel()
            await asyncio.wait([task])
            assert time.monotonic() - began_s < STOP_S
        assert await wave.perform(call(times=1.0), lambda _share, _text: None) == {"waves": 1.0, "calls": 1.0}
        await wave.close()

    run(scene())


def test_sigterm_ends_what_offers_skills_in_order() -> None:
    cancelled = []

    async def serve() -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            cancelled.append(True)
            raise

    asyncio.run(until_ended(serve()))
    assert cancelled == [True]
