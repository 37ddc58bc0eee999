"""A host of skills that is killed or frozen leaves no program, and all safe."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hil_fakes.pin_files import is_on
from hil_fakes.sound_server import wait_until
from tests.skills.calls import fake_pins, program_of, until_gone

HOST = """
import asyncio, sys
from hvcpd.config.skill_settings import PinSettings
from hvcpd.skills.guard import GuardLine
from hvcpd.skills.life import Call
from hvcpd.skills.objects import PythonRunner
from hvcpd.skills.pins import PinRunner
from hvcpd.skills.runners import ProgramRunner
guard = GuardLine({17: True})
async def main():
    arguments = {"seconds": 60.0}
    if sys.argv[1] == "pin":
        runner = PinRunner(PinSettings(17))
    elif sys.argv[1] == "object":
        runner, arguments = PythonRunner("odd", guard), {"how": "nests", "pid": sys.argv[2]}
    else:
        runner = ProgramRunner(("sh", "-c", "echo $$ > $0; sleep 60", sys.argv[2]), ("touch", sys.argv[3]), guard)
    beat = asyncio.create_task(guard.beat())
    await runner.perform(Call(1, 1, "pour", tuple(arguments.items()), 60.0), lambda share, text: None)
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


@pytest.mark.usefixtures("package")
def test_a_host_that_is_killed_leaves_nothing_that_a_python_object_has_started(tmp_path: Path) -> None:
    """The object ended with its host, and what it had started ran on."""
    pid = tmp_path / "pid"
    with subprocess.Popen([sys.executable, "-c", HOST, "object", str(pid)], env=fake_pins(tmp_path)) as host:
        wait_until(lambda: program_of(pid) is not None, 10.0, "it has started a program")
        host.kill()
        wait_until(lambda: "sleep" not in _read(Path(f"/proc/{program_of(pid)}/cmdline")), 10.0, "the program ends")


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
