"""Programs and Python objects carry calls out; cancelled, hung or killed, they leave all safe."""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from structlog.testing import capture_logs

from hil_fakes.sound_server import wait_until
from hvcpd.control.live.skills import until_ended
from hvcpd.skills.life import MAX_RESULTS
from hvcpd.skills.objects import PythonRunner
from hvcpd.skills.runners import FailedError, ProgramRunner, fault_of_running
from tests.skills.calls import STOP_S, call, cancelled, met, perform, program_of, run, shell, until_gone

STOPPED = "TD"
"""States in /proc/PID/stat: stopped, or waiting for a child that was stopped before its exec (vfork)."""


def test_a_program_tells_how_far_it_is_and_what_came_of_it() -> None:
    half, litres = '{"progress": 0.5, "text": "half"}', '{"results": {"litres": 0.4}}'
    assert perform(shell(f"echo '{half}'; echo noise; echo '{litres}'")) == ({"litres": 0.4}, [(0.5, "half")])


async def test_a_program_in_python_need_not_flush_what_it_prints(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its progress came when it had ended, and a reason that it gave before a cancel never."""
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    # it sleeps in a process of its own, which is ended as soon as its line is there
    program = ProgramRunner((sys.executable, "-c", "import time; print('{\"progress\": 0.5}'); time.sleep(60)"))
    told = asyncio.Event()
    task = asyncio.create_task(program.perform(call(), lambda _share, _text: told.set()))  # type: ignore[arg-type]
    await told.wait()
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


def test_arguments_stand_in_its_words_and_no_shell_reads_them() -> None:
    echo = "import sys, json; print(json.dumps({'results': dict(enumerate(sys.argv[1:]))}))"
    program = ProgramRunner((sys.executable, "-c", echo, "{litres}", "to {what}"))
    found, _ = perform(program, call(litres=0.25, what="$(reboot); 'x' {litres}"))
    assert found == {"0": "0.25", "1": "to $(reboot); 'x' {litres}"}


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


def test_results_are_numbers_and_texts_as_many_as_fit_one_line() -> None:
    """One true or false ended the process of all skills; a number that is none let the call hang until its limit."""
    odd = r'{"results": {"yes": true, "none": null, "nan": NaN, "huge": 1e999, "list": [1], "half": "\\ud800"}}'
    many = "import json\nfor n in range(99): print(json.dumps({'results': {str(n): 'x' * 2000}}))"
    found, _ = perform(shell(f"echo '{odd}'"))
    assert found == {"yes": 1.0, "none": "None", "nan": "nan", "huge": "inf", "list": "[1]", "half": "?"}
    found, _ = perform(ProgramRunner((sys.executable, "-c", many)))
    assert found == {str(n): "x" * 200 for n in range(MAX_RESULTS)}


@pytest.mark.parametrize("before", ["", "setsid "])
def test_a_program_is_done_when_it_ends_whatever_it_has_started(before: str) -> None:
    """The call lasted as long as anybody had its output open, and then failed at its time limit."""
    began_s = time.monotonic()
    found, _ = perform(shell(f"""{before}sleep 9 & echo '{{"results": {{"a": 1}}}}'"""))
    assert found == {"a": 1.0}
    assert time.monotonic() - began_s < 5.0


def test_a_program_that_is_cancelled_waits_for_nobody_in_a_session_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its output was still open when the loop was closed, and Python complained about that later."""
    complaints = list[object]()
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)  # made by Python to be set
    began = tmp_path / "began"
    deaf = shell(f"trap '' TERM; setsid sleep 9 & touch {began}; sleep 9; sleep 9")
    assert run(cancelled(deaf, began.exists)) < STOP_S
    gc.collect()
    assert complaints == []


def test_a_parameter_that_a_new_task_file_no_longer_has_is_a_failed_call() -> None:
    with pytest.raises(FailedError, match="it is not told `litres`"):
        perform(shell("", "{litres}"))


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


async def test_a_cancel_that_comes_before_a_program_is_known_to_run_ends_it_too(tmp_path: Path) -> None:
    """What it had started lived on, and nothing was left safe: a cancel ended the waiting for it to be started."""
    pid, safe = tmp_path / "pid", tmp_path / "safe"
    program = ProgramRunner(("sh", "-c", f"sleep 60 & echo $$ > {pid}; wait"), ("touch", str(safe)))
    task = asyncio.create_task(program.perform(call(), lambda _share, _text: None))  # type: ignore[arg-type]
    while program_of(pid) is None:
        await asyncio.sleep(0)  # one step of the loop, and as long for the program as it needs
        with suppress(TimeoutError):
            wait_until(lambda: program_of(pid) is not None, 0.1, "it runs")
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
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


def test_the_program_that_leaves_all_safe_may_print_much(tmp_path: Path) -> None:
    """It waited for somebody to read its output, and was killed before it had done anything."""
    safe = ("sh", "-c", f"head -c 300000 /dev/zero; touch {tmp_path}/safe")
    with capture_logs() as logs, pytest.raises(FailedError):
        perform(ProgramRunner(("false",), safe))
    assert (tmp_path / "safe").exists()
    assert logs == []


@pytest.mark.parametrize(
    ("safe", "reason"),
    [
        (("/no/such",), "No such file or directory"),
        (("sh", "-c", "exit 3"), "exit status 3"),
        (("sh", "-c", "kill -9 $$"), "ended by signal 9"),
    ],
)
def test_a_failure_to_leave_all_safe_is_logged(safe: tuple[str, ...], reason: str) -> None:
    with capture_logs() as logs, pytest.raises(FailedError, match="exit status 1"):
        perform(ProgramRunner(("false",), safe))
    assert logs == [{"event": "not left safe", "log_level": "error", "program": safe[0], "reason": reason}]


def test_a_program_that_leaves_all_safe_too_slowly_is_ended() -> None:
    assert run(fault_of_running(("sleep", "60"), within_s=0.05)) == "it was ended after 0.05 s"


async def test_a_program_that_is_held_stands_still(tmp_path: Path) -> None:
    """The kernel says that it is stopped while it is held; let go, it counts on."""
    program = shell('while :; do echo "{\\"progress\\": 0.5, \\"text\\": \\"$$\\"}"; sleep 0.01; done')
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


def stopped_children() -> int:
    """Number of this process's children that are stopped."""
    stats = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            stats.append(path.read_text().rpartition(")")[2].split()[:2])
    return sum(state in STOPPED and int(parent) == os.getpid() for state, parent in stats)


async def test_a_program_that_is_held_while_it_starts_stands_still() -> None:
    """It ran on while the robot stood."""
    program = shell("sleep 60")
    task = asyncio.create_task(program.perform(call(), lambda _share, _text: None))  # type: ignore[arg-type]
    await asyncio.sleep(0)
    program.hold(True)
    await met(lambda: stopped_children() == 1, "the program is stopped")
    task.cancel()
    await asyncio.wait([task])


@pytest.mark.usefixtures("package")
async def test_a_python_object_lives_on_from_call_to_call_and_one_that_hangs_is_killed() -> None:
    wave = PythonRunner("wave")
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


@pytest.mark.usefixtures("package")
async def test_a_python_object_that_answers_oddly_fails_that_call_and_no_other(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """It hung until its time limit, and one that left took the next call with it."""
    odd = PythonRunner("odd")

    async def answer(how: str) -> Mapping[str, Any]:
        return await odd.perform(call(how=how), lambda _share, _text: None)

    for how, why in (
        ("nothing", "TypeError: perform returned None, not a Result"),
        ("at length", "x" * 200),
        ("no results", "AttributeError: 'NoneType' object"),
        ("leaves", "SystemExit: 3"),
    ):
        with pytest.raises(FailedError, match=why):
            await answer(how)
    assert await answer("lists") == {"list": "[1]", "true": 1.0, "infinite": "inf", "long": "x" * 200}
    await odd.close()
    assert "example_skill.py" in capfd.readouterr().err, "its author sees where"


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
