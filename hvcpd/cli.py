"""The `hvcpd` command: one robot, until it is told to stop."""

from __future__ import annotations

from hvcpd.config.interruption import handled, interrupt_ends, unwrapped

with interrupt_ends():
    import argparse
    import signal
    import sys
    from collections.abc import Callable, Iterable, Sequence
    from functools import partial
    from pathlib import Path
    from typing import TYPE_CHECKING

    from hvcpd import __version__
    from hvcpd.config.command_line import Parser, discard_output, output_fault, prepare_streams, print_error
    from hvcpd.errors import EX_INTERRUPTED, EX_OK, EX_SOFTWARE, EX_USAGE, HvcpdError

if TYPE_CHECKING:
    from hvcpd.config.settings import Settings
    from hvcpd.daemon.devices import Devices
    from hvcpd.daemon.logging import RateLimiter
    from hvcpd.daemon.main_loop import Daemon
    from hvcpd.daemon.preflight import Preflight

_EPILOG = (
    "Exit status, as in sysexits.h: 0 stopped by a signal, 64 wrong usage, 69 a device is missing or failed, 70 a "
    "fault of hvcpd, 73 the memory's folder cannot be written, 78 an error in the settings or tasks, or a memory of a "
    "newer version, 130 interrupted before it began. SIGHUP, or hvcpctl reload, makes it read its settings again; "
    "SIGTERM and SIGINT let it say that it leaves, a second one ends it at once."
)


class _Parser(Parser):
    usage_status = EX_USAGE


def make_parser() -> argparse.ArgumentParser:
    """The parser of the command line; wrong usage ends the process with EX_USAGE."""
    parser = _Parser(
        prog="hvcpd", description="A robot that coordinates with others by speaking English.", epilog=_EPILOG
    )
    parser.add_argument("--version", action="version", version=f"hvcpd {__version__}")
    parser.add_argument("--name", metavar="NAME", help="the robot's name, for example Rob")
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings (default: /etc/hvcpd/hvcpd.yaml)")
    parser.add_argument("--team", metavar="NAME", help="the robot's team (default: plant)")
    parser.add_argument("--tasks", metavar="FILE", help="task file (default: five plants)")
    parser.add_argument(
        "--mode",
        choices=("volunteer", "coordinate", "follow"),
        help="pick tasks (default), give orders, or wait for orders",
    )
    parser.add_argument(
        "--allow-confusable", action="store_true", help="also use tasks and names that robots may confuse"
    )
    parser.add_argument("--log-format", choices=("auto", "console", "keyvalue", "json"), help="default: auto")
    parser.add_argument("--log-level", choices=("debug", "info", "warning", "error"), help="default: info")
    parser.add_argument(
        "--check", action="store_true", help="only check that everything needed is there, and open nothing"
    )
    return parser


def main(arguments: Sequence[str] | None = None, devices: Devices | None = None) -> int:
    """Run `hvcpd`; returns the exit status. `devices` are the real ones by default."""
    hangups: list[int] = []
    """SIGHUPs before the daemon can obey them: by default they would end it, which systemd takes for an orderly end."""
    try:
        with unwrapped(), handled(lambda number, _: hangups.append(number), signal.SIGHUP):
            return _started(arguments, devices, hangups)
    except KeyboardInterrupt:  # before there is a robot that could say that it leaves
        return EX_INTERRUPTED


def _started(arguments: Sequence[str] | None, devices: Devices | None, hangups: Sequence[int]) -> int:
    from hvcpd.daemon.allocator import load_libraries, tune_allocator

    prepare_streams()
    tune_allocator()
    load_libraries()  # before anything else loads them, as argparse does
    try:
        options = make_parser().parse_args(arguments)
    except SystemExit:  # after a help text, too
        _flush()
        raise
    except OSError as error:  # the help text itself, where nothing is held back
        _output_failed(error)
        return EX_OK
    return _start(options, devices, hangups)


def _start(options: argparse.Namespace, devices: Devices | None, hangups: Sequence[int]) -> int:
    from hvcpd.config.settings_file import load_with_sources
    from hvcpd.daemon.allocator import exempt_modules
    from hvcpd.daemon.devices import Devices
    from hvcpd.daemon.logging import set_up_logging
    from hvcpd.daemon.notify import ServiceManager
    from hvcpd.daemon.preflight import examine
    from hvcpd.synthesis.likeness import name_check

    devices = devices or Devices()
    overrides = {key: getattr(options, key) for key in ("name", "team", "tasks", "mode", "log_level", "log_format")}
    load = partial(load_with_sources, options.config, overrides, reserved=name_check)
    try:
        loaded = load()
    except HvcpdError as error:
        print_error("hvcpd", str(error))
        return error.exit_status
    settings = loaded.settings
    manager = ServiceManager()
    manager.status("checking that everything is there; the first time takes longest")
    places = loaded.skill_places
    preflight = examine(settings, devices, allow_confusable=options.allow_confusable, skill_places=places)
    _show(preflight, options.check)
    if options.check or preflight.wiring is None or preflight.exit_status != EX_OK:
        return preflight.exit_status
    limiter = set_up_logging(settings.log_level, form=settings.log_format)

    def set_log(settings: Settings) -> None:
        set_up_logging(settings.log_level, form=settings.log_format, limiter=limiter)

    from hvcpd.daemon.main_loop import Daemon
    from hvcpd.daemon.reloading import Rereading

    exempt_modules()
    rereading = Rereading(load, loaded.sources, set_log, options.allow_confusable)
    return _run(Daemon(preflight.wiring, devices, manager, rereading), limiter, hangups)


def _show(preflight: Preflight, ok_too: bool) -> None:
    """Tell the findings; the exit status is theirs, wherever the output goes."""
    if ok_too:
        good = (finding for finding in preflight.findings if finding.ok and not finding.doubtful)
        _flush(f"ok  {finding.subject}: {finding.text}\n" for finding in good)
    for finding in preflight.findings:
        if not finding.ok:
            print_error("hvcpd", finding.text)
        elif finding.doubtful:
            print_error("hvcpd", f"warning: {finding.text}")


def _flush(lines: Iterable[str] = ()) -> None:
    """Write the lines and all that waits; a fault of the output is no fault of the robot."""
    try:
        sys.stdout.writelines(lines)
        sys.stdout.flush()
    except (OSError, UnicodeEncodeError) as error:
        _output_failed(error)


def _output_failed(error: OSError | UnicodeEncodeError) -> None:
    discard_output(sys.stdout)
    if not isinstance(error, BrokenPipeError):
        print_error("hvcpd", output_fault(error))


def _run(daemon: Daemon, limiter: RateLimiter, hangups: Sequence[int]) -> int:
    import asyncio

    import structlog

    from hvcpd.daemon.allocator import give_back_memory
    from hvcpd.daemon.library_output import LibraryOutput
    from hvcpd.daemon.logging import log_held_back
    from hvcpd.recognition import arrays

    log = structlog.get_logger(__name__)
    output = LibraryOutput()
    output.begin()

    def clean_up() -> None:
        log_held_back(limiter)
        output.report()
        arrays.release_pages()
        if daemon.robot is None or not daemon.robot.speaking:  # it may take as long as a block of sound
            give_back_memory()

    try:
        error = asyncio.run(_serve(daemon, hangups, output.drain, clean_up))
    finally:
        output.end()
    if isinstance(error, HvcpdError):
        log.error("failed", reason=str(error), exit_status=error.exit_status)
        return error.exit_status
    if error is not None:  # a fault of ours: the log has it, and the wheels are stopped already
        log.error("crashed", exc_info=error, exit_status=EX_SOFTWARE)
        return EX_SOFTWARE
    log_held_back(limiter)
    log.info("stopped")
    return EX_OK


async def _serve(
    daemon: Daemon, hangups: Sequence[int], every_second: Callable[[], None], every_minute: Callable[[], None]
) -> BaseException | None:
    """Let the daemon run until a signal, or until what is returned ends it; the wheels are stopped then.

    At the first signal the robot says that it leaves; a second one ends it without a word. `hangups` came before.
    """
    import asyncio

    from hvcpd.daemon.logging import HELD_BACK_EVERY_S
    from hvcpd.daemon.main_loop import FAREWELL_WALL_S

    life = asyncio.ensure_future(daemon.run())
    loop = asyncio.get_running_loop()

    def look_after_log(minute_s: float) -> None:
        every_second()
        is_over = loop.time() >= minute_s
        if is_over:
            every_minute()
        loop.call_later(1.0, look_after_log, minute_s + is_over * HELD_BACK_EVERY_S)

    look_after_log(loop.time() + HELD_BACK_EVERY_S)
    asked: list[signal.Signals] = []
    ended: list[bool] = []

    def stop(number: signal.Signals) -> None:
        asked.append(number)
        if len(asked) == 1 and daemon.listening:
            daemon.leave()
            loop.call_later(FAREWELL_WALL_S, end)
        else:
            end()

    def end() -> None:
        if not ended:  # a further signal must not cut the orderly end short
            ended.append(True)
            life.cancel()

    reloads: set[asyncio.Task[None]] = set()

    def reload() -> None:
        task = loop.create_task(daemon.reload())
        reloads.add(task)
        task.add_done_callback(reloads.discard)

    loop.add_signal_handler(signal.SIGHUP, reload)
    if hangups:
        reload()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stop, number)
    try:
        await asyncio.wait([life])
    except asyncio.CancelledError:
        life.cancel()
        await asyncio.wait([life])
        raise
    return life.exception() if not life.cancelled() else None


if __name__ == "__main__":
    sys.exit(main())
