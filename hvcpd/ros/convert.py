"""From our plain messages to those of the ROS that is there, and back: field by field, whatever the type."""

from __future__ import annotations

import atexit
import dataclasses
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from hvcpd.ros import messages as m

T = TypeVar("T")


@dataclass(frozen=True)
class Dialect:
    """Where ROS 1 and ROS 2 differ: how a time is made, and what Python has for a `byte`."""

    time: Callable[[int, int], Any]
    byte: Callable[[int], Any]


OWN = {each.ROS_TYPE: each for each in (m.Word, m.Sentence, m.Task, m.TaskArray, m.RobotState)}
"""The messages that are our own."""


@cache
def ros_class(ros_type: str) -> Any:
    """The class of a type such as "std_msgs/String"; for ROS 1 genpy makes our own, with the same checksum, where
    their package is not installed. Raises ImportError if a package is missing."""
    package, name = ros_type.split("/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except ImportError:
        if ros_type not in OWN or "genpy" not in sys.modules:
            raise
    dynamic: Any = import_module("genpy.dynamic")
    made = dynamic.generate_dynamic(ros_type, _whole_definition(OWN[ros_type]))[ros_type]
    # genpy deletes the folder that it was made in when this process ends, which a bridge that starts again does not.
    atexit.unregister(shutil.rmtree)
    shutil.rmtree(Path(str(sys.modules[made.__module__].__file__)).parent)
    return made


def definition(plain: Any) -> str:
    """The definition of one of our messages as ROS writes it, a field a line."""
    return "".join(f"{_ros_name(hint)} {name}\n" for name, hint in field_types(plain).items())


def _ros_name(hint: Any) -> str:
    if hint == m.Covariance:
        return f"float64[{m.COVARIANCE_SIZE}]"
    if hint in (m.Int32, m.Uint32, m.Byte):
        return str(get_args(hint)[1])
    if get_origin(hint) is tuple:
        return f"{_ros_name(get_args(hint)[0])}[]"
    simple: dict[Any, str] = {str: "string", bool: "bool", float: "float64"}
    return simple[hint] if hint in simple else str(hint.ROS_TYPE)


def _whole_definition(plain: Any) -> str:
    """The definition with those of its fields' types, as ROS 1 puts them together."""
    parts = [definition(plain)]
    for kind in sorted(_nested(plain), key=lambda each: str(each.ROS_TYPE)):
        text = ros_class(kind.ROS_TYPE)._full_text if kind is m.Header else definition(kind)
        parts.append(f"MSG: {kind.ROS_TYPE}\n{text}")
    return f"{'=' * 80}\n".join(parts)


def _nested(plain: Any) -> set[Any]:
    """The message types of its fields, and of theirs, as far as ROS's Header, whose fields are other ones in ROS 1."""
    hints = [get_args(hint)[0] if get_origin(hint) is tuple else hint for hint in field_types(plain).values()]
    found = {hint for hint in hints if dataclasses.is_dataclass(hint)}
    return found.union(*(_nested(each) for each in found - {m.Header}))


def to_ros(value: Any, dialect: Dialect) -> Any:
    """The ROS message with the same content."""
    if isinstance(value, m.Time):
        return dialect.time(value.sec, value.nanosec)
    if isinstance(value, tuple):
        return [to_ros(each, dialect) for each in value]
    if not dataclasses.is_dataclass(value):
        return value
    plain: Any = type(value)
    message = ros_class(plain.ROS_TYPE)()
    for name, hint in field_types(plain).items():
        content = getattr(value, name)
        setattr(message, name, dialect.byte(content) if hint == m.Byte else to_ros(content, dialect))
    return message


def from_ros(message: Any, plain: type[T]) -> T:
    """Our message with the content of a ROS message."""
    hints = field_types(plain)  # type: ignore[arg-type]  # to mypy a class is not hashable
    return plain(**{name: _plain(getattr(message, name), hint) for name, hint in hints.items()})


@cache
def field_types(plain: Any) -> dict[str, Any]:
    """Each field with its type, in ROS's order."""
    hints = get_type_hints(plain, include_extras=True)
    return {each.name: hints[each.name] for each in dataclasses.fields(plain)}


def _plain(value: Any, hint: Any) -> Any:
    if hint is m.Time:
        seconds = value.sec if hasattr(value, "sec") else value.secs
        return m.Time(seconds, value.nanosec if hasattr(value, "nanosec") else value.nsecs)
    if dataclasses.is_dataclass(hint):
        return from_ros(value, hint)  # type: ignore[arg-type]
    if hint == m.Byte:
        return value[0] if isinstance(value, bytes) else value
    inner = get_args(hint)[0] if get_args(hint) else None
    if get_origin(hint) is tuple:
        return tuple(_plain(each, inner) for each in value)
    if get_origin(inner) is tuple:  # of a fixed length
        return tuple(float(each) for each in value)
    return value
