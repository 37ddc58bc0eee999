"""A mission or a robot's shift as an MCAP file, with the messages that Foxglove knows, encoded as JSON.

Format: https://mcap.dev/spec; messages: Foxglove's schemas `Log`, `PoseInFrame` and `RawAudio`.
"""

from __future__ import annotations

import base64
import io
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from hvcpd.errors import ConfigError, how_to_install
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.reporting.events import Trail
from hvcpd.reporting.pcm import pcm_16

FRAME = "room"
"""The frame of all poses: metres, x and y in the floor's plane (docs/worlds.md)."""
INFO = 2
"""A log's level."""
SOUND_S = 0.5
"""Duration of sound in one message: short enough to be sought in, long enough that its frame is small beside it."""

_TIME = {"type": "object", "title": "time", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
_NUMBER, _STRING = {"type": "number"}, {"type": "string"}


def _object(properties: Mapping[str, Any], title: str = "") -> dict[str, Any]:
    return {"type": "object", "properties": dict(properties)} | ({"title": title} if title else {})


_POSE = _object(
    {"position": _object(dict.fromkeys("xyz", _NUMBER)), "orientation": _object(dict.fromkeys("xyzw", _NUMBER))}
)
SCHEMAS: dict[str, dict[str, Any]] = {
    "foxglove.Log": _object(
        {"timestamp": _TIME, "level": {"type": "integer"}, "message": _STRING, "name": _STRING}, "foxglove.Log"
    ),
    "foxglove.PoseInFrame": _object({"timestamp": _TIME, "frame_id": _STRING, "pose": _POSE}, "foxglove.PoseInFrame"),
    "foxglove.RawAudio": _object(
        {
            "timestamp": _TIME,
            "data": {"type": "string", "contentEncoding": "base64"},
            "format": _STRING,
            "sample_rate": {"type": "integer"},
            "number_of_channels": {"type": "integer"},
        },
        "foxglove.RawAudio",
    ),
    "hvcpd.Event": {"type": "object", "title": "hvcpd.Event"},
}
"""By name, as JSON Schema."""


@dataclass(frozen=True)
class Message:
    """`at_s` counts from 1970, or from a mission's beginning."""

    at_s: float
    topic: str
    schema: str
    body: dict[str, Any]


def write_mcap(messages: Iterable[Message]) -> bytes:
    """Return the messages, in order of their time, as an MCAP file. Raises ConfigError without the library."""
    try:
        from mcap.writer import CompressionType, Writer
    except ImportError:
        raise ConfigError(f"the MCAP library is missing: {how_to_install('mcap')}") from None
    file = io.BytesIO()
    writer: Any = Writer(file, compression=CompressionType.ZSTD)
    writer.start(profile="", library="hvcpd")
    schemas = {
        name: writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
        for name, schema in SCHEMAS.items()
    }
    channels: dict[str, int] = {}
    for message in sorted(messages, key=lambda message: message.at_s):
        if message.topic not in channels:
            channels[message.topic] = writer.register_channel(message.topic, "json", schemas[message.schema])
        at_ns = round(message.at_s * 1e9)
        writer.add_message(channels[message.topic], at_ns, json.dumps(message.body).encode(), at_ns)
    writer.finish()
    return file.getvalue()


def of_event(event: Mapping[str, Any], at_s: float) -> Iterable[Message]:
    """Yield an event as JSON lines have it: what is said as a line of the log, a pose and sound as such, and each but
    sound by itself."""
    kind = str(event.get("event"))
    if kind == "sound":
        yield _sound(at_s, base64.b64encode(base64.b64decode(event["pcm"], validate=True)).decode())
        return
    if kind in ("said", "heard") and "text" in event:
        listener = event.get("listener")
        topic = "/said" if kind == "said" else f"/{listener}/heard"
        yield _log(at_s, topic, str(event.get("speaker")), str(event["text"]))
    for number, pose in enumerate(event.get("poses") or () if kind == "moved" else ()):
        yield _pose(at_s, f"/pose/{number}", pose["x_m"], pose["y_m"], pose["heading_rad"])
    yield Message(at_s, f"/events/{kind}", "hvcpd.Event", dict(event))


def of_trail(trail: Trail) -> Iterable[Message]:
    """Yield a robot's way as poses; it heads where it goes."""
    heading_rad = 0.0
    points = list(zip(trail.t_s.tolist(), trail.x_m.tolist(), trail.y_m.tolist(), strict=True))
    for (t_s, x_m, y_m), (_, next_x_m, next_y_m) in zip(points, [*points[1:], points[-1]], strict=True):
        if (x_m, y_m) != (next_x_m, next_y_m):
            heading_rad = math.atan2(next_y_m - y_m, next_x_m - x_m)
        yield _pose(t_s, f"/pose/{trail.robot}", x_m, y_m, heading_rad)


def of_sound(sound: Samples) -> Iterable[Message]:
    """Yield sound of shape (n,), 1.0 = full scale, `SAMPLE_RATE_HZ`, as 16-bit PCM."""
    n = samples_in(SOUND_S)
    for start in range(0, len(sound), n):
        pcm = base64.b64encode(pcm_16(sound[start : start + n])).decode()
        yield _sound(start / SAMPLE_RATE_HZ, pcm)


def _sound(at_s: float, pcm: str) -> Message:
    """`pcm`: 16-bit, in base64."""
    format_ = {"format": "pcm-s16", "sample_rate": SAMPLE_RATE_HZ, "number_of_channels": 1}
    return Message(at_s, "/sound", "foxglove.RawAudio", {"timestamp": _time(at_s), "data": pcm, **format_})


def _log(at_s: float, topic: str, name: str, text: str) -> Message:
    body = {"timestamp": _time(at_s), "level": INFO, "message": f"{name}: {text}", "name": name}
    return Message(at_s, topic, "foxglove.Log", body)


def _pose(at_s: float, topic: str, x_m: float, y_m: float, heading_rad: float) -> Message:
    half_rad = heading_rad / 2.0
    pose = {
        "position": {"x": x_m, "y": y_m, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half_rad), "w": math.cos(half_rad)},
    }
    return Message(at_s, topic, "foxglove.PoseInFrame", {"timestamp": _time(at_s), "frame_id": FRAME, "pose": pose})


def _time(at_s: float) -> dict[str, int]:
    sec, nsec = divmod(round(at_s * 1e9), 1_000_000_000)
    return {"sec": sec, "nsec": nsec}
