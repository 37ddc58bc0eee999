"""Sound cards: finding them by name, and one full-duplex stream for the daemon.

PortAudio, through the package sounddevice, is loaded inside functions: without it, or with an ALSA configuration
that lacks `pcm.default` (which aborts the process at that moment), every other command still works. Functions take
the module as an argument, so that a fake card can stand in for it.
"""

from __future__ import annotations

import atexit
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from hvcpd.errors import DeviceError, alike, how_to_install

Direction = Literal["input", "output"]

SOUND_CARDS = Path("/sys/class/sound")
"""The kernel's list of sound cards; /proc/asound has the same, but the systemd unit shows the service no more of /proc
than processes."""
ALSA_NAME = re.compile(r"(?:(?:plug|sys)?hw:(?:CARD=)?|CARD=)(?P<id>\w+)(?:,(?:DEV=)?(?P<device>\d+))?", re.I)
"""As `aplay -L` and asound.conf write a card; PortAudio converts nothing by itself, so plughw is hw here."""

KIND = {"input": "microphone", "output": "loudspeaker"}


@dataclass(frozen=True)
class SoundDevice:
    """A sound device as PortAudio lists it; a card that both hears and speaks is one device."""

    index: int
    name: str
    inputs: int
    outputs: int
    rate_hz: float

    def can(self, direction: Direction) -> bool:
        """Whether it has a channel of that direction."""
        return (self.inputs if direction == "input" else self.outputs) > 0


def load_backend() -> Any:
    """The module sounddevice. Raises DeviceError, with the remedy, if it or PortAudio is missing, or does not start."""
    try:
        import sounddevice

        # Its farewell waits for streams; one that hangs would keep the process from ending. The kernel closes all.
        atexit.unregister(sounddevice._exit_handler)
    except ImportError as error:
        raise DeviceError(
            f"the Python package sounddevice is missing ({error}); `{how_to_install('sounddevice')}`"
        ) from error
    except OSError as error:  # sounddevice's way to say that the PortAudio library cannot be loaded
        raise DeviceError(f"the PortAudio library is missing ({error}); `apt install libportaudio2`") from error
    except Exception as error:  # sounddevice's own, whose class is not there where the import fails
        raise DeviceError(f"PortAudio does not start ({error}); is ALSA set up? see `aplay -l`") from error
    return sounddevice


def list_devices(backend: Any) -> tuple[SoundDevice, ...]:
    """All sound devices. Raises DeviceError if PortAudio cannot list them."""
    try:
        found = backend.query_devices()
    except backend.PortAudioError as error:
        raise DeviceError(f"the sound cards cannot be listed ({error}); is ALSA set up? see `aplay -l`") from error
    return tuple(
        SoundDevice(
            index, item["name"], item["max_input_channels"], item["max_output_channels"], item["default_samplerate"]
        )
        for index, item in enumerate(found)
    )


def list_afresh(backend: Any) -> None:
    """Have PortAudio list the devices again: it keeps the list from its start. No stream may be open.

    Raises DeviceError.
    """
    try:
        with suppress(backend.PortAudioError):  # it has ended already where it did not start again the last time
            backend._terminate()
        backend._initialize()
    except backend.PortAudioError as error:
        raise DeviceError(f"PortAudio cannot be restarted ({error}); does the sound server run?") from error


def card_ids(folder: Path = SOUND_CARDS) -> dict[str, int]:
    """ALSA's numbers of the cards by their ids, which unlike the numbers outlive a boot; empty without ALSA."""
    found = {}
    for path in sorted(folder.glob("card*/id")):
        with suppress(OSError, ValueError):  # pulled out this moment
            found[path.read_text().strip()] = int(path.parent.name.removeprefix("card"))
    return found


def find_device(
    backend: Any, direction: Direction, wanted: str | None, cards: Callable[[], Mapping[str, int]] = card_ids
) -> SoundDevice:
    """The device whose name is, or else contains, `wanted` without regard to case; None is the system's default.

    An ALSA name, as "hw:CARD=Device" or "plughw:1,0", is that card's device; with its id, whatever its number is at
    present. Raises DeviceError that names the nearest device, or all there are.
    """
    able = [device for device in list_devices(backend) if device.can(direction)]
    kind = KIND[direction]
    if not able:
        raise DeviceError(f"there is no {kind} on this machine; connect one, then look with `arecord -l`, `aplay -l`")
    if wanted is None:
        return _default_device(backend, direction, able)
    key = f"audio.{direction}_device"
    if card := ALSA_NAME.fullmatch(wanted):
        return _device_of_card(card, key, kind, able, cards())
    matches = [device for device in able if wanted.casefold() == device.name.casefold()]
    matches = matches or [device for device in able if wanted.casefold() in device.name.casefold()]
    if len(matches) > 1:
        raise DeviceError(f"{key}: {wanted!r} is part of several names; write more of one of {_listed(matches)}")
    if not matches:
        near = alike(wanted, [device.name for device in able], 0.5)
        hint = f"did you mean {near!r}?" if near else f"choose one of {_listed(able)}"
        raise DeviceError(f"{key}: there is no {kind} {wanted!r}; {hint}")
    return matches[0]


def _device_of_card(
    wanted: re.Match[str], key: str, kind: str, able: Sequence[SoundDevice], cards: Mapping[str, int]
) -> SoundDevice:
    number = int(wanted["id"]) if wanted["id"].isdecimal() else cards.get(wanted["id"])
    if number is None:
        near = alike(wanted["id"], cards, 0.5)
        listed = ", ".join(map(repr, cards))
        hint = f"did you mean {near!r}?" if near else f"there is {listed}" if cards else "there is no sound card"
        raise DeviceError(f"{key}: there is no sound card with the id {wanted['id']!r}; {hint}")
    place = f"(hw:{number},{wanted['device']})" if wanted["device"] else f"(hw:{number},"
    found = next((device for device in able if place in device.name), None)
    if found is None:
        raise DeviceError(
            f"{key}: the sound card {wanted['id']!r} has no {kind} {place.rstrip(',')!r} that is free; is another "
            f"program using it? Else choose one of {_listed(able)}"
        )
    return found


def _default_device(backend: Any, direction: Direction, able: Sequence[SoundDevice]) -> SoundDevice:
    try:
        index = backend.query_devices(kind=direction)["index"]
    except (backend.PortAudioError, ValueError):
        # No default is set, or it lacks this direction: the only device there can still be meant.
        index = able[0].index if len(able) == 1 else None
    chosen = next((device for device in able if device.index == index), None)
    if chosen is None:
        key = f"audio.{direction}_device"
        raise DeviceError(f"{key}: the system has no default {KIND[direction]}; set it to one of {_listed(able)}")
    return chosen


def _listed(devices: Sequence[SoundDevice]) -> str:
    return ", ".join(repr(device.name) for device in devices)
