"""`hvcpctl duet`: whole daemons with fake wheels talk through this computer's sound card, or through simulated air."""

from __future__ import annotations

import argparse
import asyncio
import os
import signal
import stat
import sys
import tempfile
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, TextIO

from hil_fakes.body import Body
from hil_fakes.room import Air, Room
from hil_fakes.shared_card import SharedCard
from hil_fakes.shared_room import SharedRoom, SimulatedAir
from hvcpd.assembly.sound import user_cache_folder
from hvcpd.config.settings import AudioSettings
from hvcpd.control.duet.cast import cast_of, rereading_of
from hvcpd.control.duet.onlookers import TYPED_BYTES, Onlooker, TypedLines, Visitor, page
from hvcpd.control.duet.rendering import Rendering, is_rendered
from hvcpd.control.duet.texts import lacking_text, partner_command, ready_text, welcome_text
from hvcpd.daemon.control_socket import socket_path
from hvcpd.daemon.devices import Devices
from hvcpd.daemon.library_output import LibraryOutput
from hvcpd.daemon.logging import set_up_logging
from hvcpd.daemon.main_loop import Daemon
from hvcpd.daemon.name_learning import Rendered, at_once
from hvcpd.daemon.reloading import Rereading
from hvcpd.daemon.wiring import Wiring
from hvcpd.errors import ConfigError, DeviceError, HvcpdError
from hvcpd.hardware.audio import find_device, load_backend
from hvcpd.hardware.audio_stream import AudioStream

LEAVE_S = 8.0
"""Wall-clock time for the farewells after Ctrl-C: two robots say theirs in turn, in 6.3 to 6.6 s (word-level
missions)."""
SLOW_S = 10.0
"""Interval of the check that simulated air keeps real time."""
SLOW_SHARE = 0.8
"""Below this share of real time robots audibly take long to answer."""
LOOK_S = 0.5
"""Interval of the checks that robots listen and sound flows; `LibraryOutput` must be read once a second."""

_FIRST_START = "      (the first start renders them: some seconds on a laptop, some minutes on a Raspberry Pi)\n"
_TOO_BUSY = "this computer is too busy: sound is lost or late; end other programs"
_SLOW = "this computer is too busy: simulated time falls behind real time; end other programs"
_LEAVING = "each robot says that it leaves; Ctrl-C again ends at once"
_DEAF = "the microphone gives nothing but zeros; the robots stand still until they hear"
_NO_SOUND = "the sound card does not answer; the robots stand still until it does"
_CARD = "through this computer's loudspeaker and microphone ({microphone})"
_PIPE = "through simulated air ({why})"


def run(options: argparse.Namespace) -> None:
    """Let the robots talk until interrupted. Raises ConfigError and DeviceError."""
    cast = cast_of(options)
    robots = tuple(name for name in cast.robots if options.as_name is None or name.lower() == options.as_name.lower())
    with tempfile.TemporaryDirectory(prefix="hvcpd-duet-") as folder, ExitStack() as stack:
        libraries = LibraryOutput()  # ALSA writes a line for each underrun
        libraries.begin()
        stack.callback(libraries.end)
        log = stack.enter_context(_open_log(robots))
        set_up_logging("warning", log, form="console")
        rereadings = {robot: rereading_of(options, cast, Path(folder), robot, k) for k, robot in enumerate(robots)}
        wirings = [rereading.read(None)[1] for rereading in rereadings.values()]
        medium, where = choose_medium(options, len(robots), wirings[0].settings.audio)
        bodies = [stack.enter_context(Body(w.settings.start.pose, seed)) for seed, w in enumerate(wirings)]
        room = SharedRoom(bodies, medium=medium)
        socket = socket_path(wirings[0].settings)
        address = "" if options.no_console else stack.enter_context(page(socket, options.port))
        sys.stdout.write(welcome_text(robots, where, address, socket))
        rendered = at_once
        if not all(map(is_rendered, wirings)):
            sys.stdout.write(_FIRST_START)
            rendering = Rendering(wirings)
            stack.callback(rendering.end)
            rendering.wait()
            rendered = rendering.ended
        visitor = Visitor(cast.visitor, wirings[0], medium.visitor.say)
        partner = partner_command(cast.robots, robots, options.config, options.tasks)
        ready = ready_text(robots, partner, by_voice=isinstance(medium, SharedCard))
        ready += lacking_text(wirings[0], options.config)
        duet = Duet(wirings, room, visitor, ready=ready, rendered=rendered, rereadings=rereadings)
        asyncio.run(duet.live(sys.stdin, libraries.drain))
        libraries.end()
        if log.tell():
            sys.stdout.write(f"The robots logged warnings: {log.name}\n")


def _open_log(robots: tuple[str, ...]) -> TextIO:
    """Open the file for warnings, so that they do not appear between sentences; each duet overwrites it. Without a
    writable home folder, it is the null device."""
    folder = user_cache_folder()
    with suppress(OSError):
        if folder is not None:
            folder.parent.mkdir(parents=True, exist_ok=True)
            return (folder.parent / f"duet-{'-'.join(robots).lower()}.log").open("w", encoding="utf-8")
    return Path(os.devnull).open("w", encoding="utf-8")


def choose_medium(
    options: argparse.Namespace, n_robots: int, audio: AudioSettings
) -> tuple[SharedCard | SimulatedAir, str]:
    """The sound card, or simulated air where there is none, and how to name it. Raises DeviceError and ConfigError.

    A robot that plays its part alone, for a partner on another computer, needs the card; and who has named a device
    wants that one.
    """
    if options.pipe and options.as_name:
        raise ConfigError(
            "--as needs a sound card: through simulated air no other computer hears it; leave out --as or --pipe"
        )
    if options.pipe and (options.input_device or options.output_device):
        raise ConfigError("--pipe: simulated air has no devices; leave out --input-device and --output-device")
    if not options.pipe:
        try:
            backend = load_backend()
            microphone = find_device(backend, "input", audio.input_device)
            find_device(backend, "output", audio.output_device)
            # The other settings keep their defaults: the room has blocks of the default length.
            shared = AudioSettings(audio.input_device, audio.output_device, audio.input_channel)
            return SharedCard(lambda: AudioStream(shared, backend)), _CARD.format(microphone=microphone.name)
        except DeviceError as error:
            if options.as_name or options.input_device or options.output_device:
                raise
            why = str(error)
    else:
        why = "--pipe"
    return SimulatedAir(Room(n_robots, Air(), seed=0), _real_time()), _PIPE.format(why=why)


def _real_time() -> Callable[[float], Awaitable[None]]:
    """Return a function that slows simulated air down to the event loop's clock; it does not catch up after a stall."""
    began_s: float | None = None

    async def pace(now_s: float) -> None:
        nonlocal began_s
        clock_s = asyncio.get_running_loop().time()
        if began_s is None or clock_s - began_s > now_s:
            began_s = clock_s - now_s
        await asyncio.sleep(now_s - (clock_s - began_s))

    return pace


class Duet:
    """Some daemons in one room, with their onlookers and a visitor."""

    def __init__(
        self,
        wirings: list[Wiring],
        room: SharedRoom,
        visitor: Visitor,
        out: TextIO | None = None,
        ready: str = "",
        rendered: Rendered = at_once,
        rereadings: Mapping[str, Rereading] | None = None,
    ) -> None:
        """`ready` is written once all robots listen; `out` is standard output by default. `rendered` is as in
        `Daemon`, and so are `rereadings`, by the robots' names."""
        self._settings = [wiring.settings for wiring in wirings]
        again = rereadings or {}
        self.daemons = [
            Daemon(w, _devices(room, k), rereading=again.get(w.settings.name), rendered=rendered)
            for k, w in enumerate(wirings)
        ]
        self._room = room
        self._visitor = visitor
        self._onlooker = Onlooker([s.name for s in self._settings], out or sys.stdout)
        self._ready = ready
        self._trouble = ""
        self._ended = False

    async def live(self, typed: Any, drain: Callable[[], None] = lambda: None) -> None:
        """Live until a signal. `typed` is a file of lines that the visitor says; `drain` is called twice a second.

        Raises what ends a daemon, and OSError where nobody can read on.
        """
        loop = asyncio.get_running_loop()
        lives = [asyncio.ensure_future(daemon.run()) for daemon in self.daemons]
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self.leave, lives)
        if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # which is how nohup has it
            loop.add_signal_handler(signal.SIGHUP, self._end, lives)  # its terminal is closed: nobody reads on
        beside = [asyncio.ensure_future(self._watch(lives, drain))]
        beside += [asyncio.ensure_future(self._onlooker.follow(socket_path(s), s.name)) for s in self._settings]
        listening = self._listen(typed)
        try:
            await asyncio.gather(*lives)
        except asyncio.CancelledError:
            if not self._ended:
                raise
        finally:
            cancel_once((*lives, *beside))
            await asyncio.gather(*lives, *beside, return_exceptions=True)
            if listening:
                loop.remove_reader(typed)
            if isinstance(self._room.medium, SharedCard):
                await self._room.medium.close()
        if self._onlooker.fault is not None:
            raise self._onlooker.fault

    @property
    def _now_s(self) -> float:
        """Time of the robots' events, which counts the sound that a card has lost."""
        robots = (daemon.robot for daemon in self.daemons)
        return max((robot.now for robot in robots if robot is not None), default=self._room.now_s)

    async def _watch(self, lives: list[asyncio.Task[None]], drain: Callable[[], None]) -> None:
        """Report once that all robots listen, and each problem when it begins; end the robots' `lives` where nothing
        can be written any more."""
        slow = SlowAir(asyncio.get_running_loop().time(), self._room.now_s)
        while True:
            drain()
            if self._onlooker.fault is not None and not self._ended:
                self._end(lives)
            self._onlooker.look(self._room.now_s)
            if self._ready and all(daemon.listening for daemon in self.daemons):
                self._onlooker.write(self._ready.rstrip())
                self._ready = ""
            sounds = [daemon.sound for daemon in self.daemons if daemon.listening and daemon.sound is not None]
            lost = any(not sound.flowing for sound in sounds)
            busy = any(sound.overload.standing for sound in sounds)
            behind = slow.look(asyncio.get_running_loop().time(), self._room.now_s) and not self._ready
            late = behind and isinstance(self._room.medium, SimulatedAir)  # a card loses sound instead
            deaf = any(sound.deaf for sound in sounds)
            trouble = _NO_SOUND if lost else _DEAF if deaf else _TOO_BUSY if busy else _SLOW if late else ""
            if trouble and trouble != self._trouble:
                self._onlooker.note(trouble)
            self._trouble = trouble
            await asyncio.sleep(LOOK_S)

    def leave(self, lives: list[asyncio.Task[None]]) -> None:
        """Have the robots say that they leave; end at once on the second call, or LEAVE_S after the first."""
        if self._ended or not all(daemon.listening for daemon in self.daemons):
            self._end(lives)
            return
        self._ended = True
        self._onlooker.note(_LEAVING)
        for daemon in self.daemons:
            daemon.leave()
        asyncio.get_running_loop().call_later(LEAVE_S, self.leave, lives)

    def _end(self, lives: list[asyncio.Task[None]]) -> None:
        self._ended = True
        cancel_once(lives)

    def _listen(self, typed: Any) -> bool:
        """Take lines as they are typed, those of a file at once; False for an input that cannot be polled."""
        loop, lines = asyncio.get_running_loop(), TypedLines()

        def take() -> bool:
            data = os.read(typed.fileno(), TYPED_BYTES)
            if not data:
                loop.remove_reader(typed)
            for line in lines.take(data):
                self.say(line)
            return bool(data)

        with suppress(ValueError, OSError):
            if stat.S_ISREG(os.fstat(typed.fileno()).st_mode):
                while take():
                    pass
                return False
            loop.add_reader(typed, take)
            return True
        return False

    def say(self, line: str) -> None:
        """The visitor says a sentence; one that is not in the phrasebook is answered by a message."""
        self._visitor.wiring = self.daemons[0].wiring
        try:
            self._onlooker.visited(self._visitor.say(line), self._now_s)
        except HvcpdError as error:
            self._onlooker.note(str(error))


def cancel_once(tasks: Iterable[asyncio.Task[None]]) -> None:
    """Cancel tasks, but none that is being cancelled: a second time would break off its end, and leave threads behind
    that write where nothing is any more."""
    for task in tasks:
        if not task.cancelling():
            task.cancel()


class SlowAir:
    """Detects that simulated air has fallen behind real time; a sound card loses sound instead."""

    def __init__(self, clock_s: float, air_s: float) -> None:
        """`clock_s` is the event loop's time, `air_s` the room's."""
        self._clock_s, self._air_s, self._is_slow = clock_s, air_s, False

    def look(self, clock_s: float, air_s: float) -> bool:
        """Whether it is behind, judged every SLOW_S."""
        if clock_s - self._clock_s >= SLOW_S:
            self._is_slow = air_s - self._air_s < SLOW_SHARE * (clock_s - self._clock_s)
            self._clock_s, self._air_s = clock_s, air_s
        return self._is_slow


def _devices(room: SharedRoom, which: int) -> Devices:
    wheels = room.bodies[which].wheels
    return Devices(make_stream=lambda _: room.streams[which], make_wheels=lambda _settings, _joints: wheels)
