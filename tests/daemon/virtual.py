"""Bodies for whole daemons in virtual time: a shared room of air, and fake motors on a pty."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from hil_fakes.body import Body
from hil_fakes.shared_room import SharedRoom, VirtualStream
from hvcpd.config.settings import AudioSettings, Settings
from hvcpd.daemon.devices import Devices
from hvcpd.hardware.stop_button import StopButton
from hvcpd.ports import Wheels
from tests.daemon.two_cards import TwoCards

__all__ = ["SharedRoom", "TwoCards", "VirtualStream", "devices_of", "shared_room"]


@contextmanager
def shared_room(settings: list[Settings], watch: Callable[[float], None]) -> Iterator[SharedRoom]:
    """A room with a body for each of the settings; motors and ptys are gone at the end."""
    with ExitStack() as stack:
        bodies = [Body(each.start.pose, seed) for seed, each in enumerate(settings)]
        for body in bodies:
            stack.push(body)
        room = SharedRoom(bodies, watch)
        for stream in room.streams:
            stream.played = []
        yield room


def devices_of(room: SharedRoom, which: int = 0, button: StopButton | None = None) -> Devices:
    """That robot's devices in the room."""

    def make_stream(_: AudioSettings) -> VirtualStream:
        return room.streams[which]

    def make_wheels(*_: object) -> Wheels:
        return room.bodies[which].wheels

    return Devices(TwoCards, make_stream, make_wheels, lambda _: button)
