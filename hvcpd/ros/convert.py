"""From our plain messages to those of the ROS that is there, and back: field by field, whatever the type."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from hvcpd.ros.messages import Byte, Time

T = TypeVar("T")


@dataclass(frozen=True)
class Dialect:
    """Where ROS 1 and ROS 2 differ: how a time is made, and what Python has for a `byte`."""

    time: Callable[[int, int], Any]
    byte: Callable[[int], Any]


@cache
def ros_class(ros_type: str) -> Any:
    """The class of a type such as "std_msgs/String". Raises ImportError if its package is not installed."""
    package, name = ros_type.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def to_ros(value: Any, dialect: Dialect) -> Any:
    """The ROS message with the same content."""
    if isinstance(value, Time):
        return dialect.time(value.sec, value.nanosec)
    if isinstance(value, tuple):
        return [to_ros(each, dialect) for each in value]
    if not dataclasses.is_dataclass(value):
        return value
    plain: Any = type(value)
    message = ros_class(plain.ROS_TYPE)()
    for name, hint in field_types(plain).items():
        content = getattr(value, name)
        setattr(message, name, dialect.byte(content) if hint == Byte else to_ros(content, dialect))
    return message


def from_ros(message: Any, plain: type[T]) -> T:
    """Our message with the content of a ROS message."""
    return plain(**{name: _plain(getattr(message, name), hint) for name, hint in field_types(plain).items()})


def field_types(plain: Any) -> dict[str, Any]:
    """Each field with its type, in ROS's order."""
    return _field_types(plain)


@cache
def _field_types(plain: Any) -> dict[str, Any]:
    hints = get_type_hints(plain, include_extras=True)
    return {each.name: hints[each.name] for each in dataclasses.fields(plain)}


def _plain(value: Any, hint: Any) -> Any:
    if hint is Time:
        seconds = value.sec if hasattr(value, "sec") else value.secs
        return Time(seconds, value.nanosec if hasattr(value, "nanosec") else value.nsecs)
    if dataclasses.is_dataclass(hint):
        return from_ros(value, hint)  # type: ignore[arg-type]
    if hint == Byte:
        return value[0] if isinstance(value, bytes) else value
    inner = get_args(hint)[0] if get_args(hint) else None
    if get_origin(hint) is tuple:
        return tuple(_plain(each, inner) for each in value)
    if get_origin(inner) is tuple:  # of a fixed length
        return tuple(float(each) for each in value)
    return value
