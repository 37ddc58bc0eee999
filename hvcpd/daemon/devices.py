"""The devices that a daemon lives on, and how to come by them; a test hands in others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hvcpd.config.settings import AudioSettings, WheelSettings
from hvcpd.config.skill_settings import StopButtonSettings
from hvcpd.hardware.audio import load_backend
from hvcpd.hardware.audio_exchange import SoundStream
from hvcpd.hardware.audio_stream import AudioStream
from hvcpd.hardware.kinematics import drive_of
from hvcpd.hardware.ros_base import RosBase
from hvcpd.hardware.stop_button import StopButton, make_stop_button
from hvcpd.ports import Wheels

if TYPE_CHECKING:
    from hvcpd.hardware.joints import Joint
    from hvcpd.hardware.wheels_bus import MakePort


def make_wheels(
    settings: WheelSettings, joints: Sequence[Joint] = (), make_port: MakePort | None = None
) -> Wheels | None:
    """The wheels that the settings ask for, with joints on their bus, not yet open; None for a robot that stands.
    `make_port` opens their serial port, if not as usual."""
    if settings.driver == "none":
        return None
    if settings.driver == "ros":
        return RosBase(drive_of(settings))
    from hvcpd.hardware.wheels_find import FoundWheels
    from hvcpd.hardware.wheels_port import WaitingPort

    return FoundWheels(settings, make_port or WaitingPort, joints=joints)


@dataclass(frozen=True)
class Devices:
    """Factories of the sound stream, the wheels and the stop button, and the list of sound cards."""

    sound_backend: Callable[[], Any] = load_backend
    make_stream: Callable[[AudioSettings], SoundStream] = AudioStream
    make_wheels: Callable[[WheelSettings, Sequence[Joint]], Wheels | None] = make_wheels
    make_stop_button: Callable[[StopButtonSettings], StopButton | None] = make_stop_button
