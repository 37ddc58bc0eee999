"""Our messages as DDS's types, made from their fields, and back: what ROS 2 has on the wire.

ROS 2 writes its messages in plain CDR, and names their types as in `std_msgs::msg::dds_::String_` (REP-2011 and
rmw_dds_common tell how names are mangled).
"""

from __future__ import annotations

import dataclasses
import types
from functools import cache
from importlib import import_module
from typing import Any, TypeVar, get_args, get_origin

from hvcpd.ros.convert import field_types
from hvcpd.ros.messages import COVARIANCE_SIZE, Byte, Covariance, Int32, Uint32

T = TypeVar("T")


def type_name(ros_type: str) -> str:
    """DDS's name of a type such as "std_msgs/String", with dots for its parts."""
    package, name = ros_type.split("/")
    return f"{package}.msg.dds_.{name}_"


def dds_class(plain: Any) -> Any:
    """The DDS type of one of our messages. Raises ImportError without cyclonedds."""
    return _dds_class(plain)


@cache
def _dds_class(plain: Any) -> Any:
    idl: Any = import_module("cyclonedds.idl")
    hints = {name: _dds_type(hint) for name, hint in field_types(plain).items()}
    made = types.new_class(
        f"{plain.__name__}_",
        (idl.IdlStruct,),
        {"typename": type_name(plain.ROS_TYPE)},
        lambda namespace: namespace.update(__annotations__=hints),
    )
    return dataclasses.dataclass(made)


def to_dds(value: Any) -> Any:
    """Return a message as an object of DDS's type."""
    if isinstance(value, tuple):
        return [to_dds(each) for each in value]
    if not dataclasses.is_dataclass(value):
        return value
    plain: Any = type(value)
    return dds_class(plain)(**{name: to_dds(getattr(value, name)) for name in field_types(plain)})


def _dds_type(hint: Any) -> Any:
    idl: Any = import_module("cyclonedds.idl.types")
    if hint == Covariance:
        return idl.array[idl.float64, COVARIANCE_SIZE]
    if hint in (Int32, Uint32):
        return idl.int32 if hint == Int32 else idl.uint32
    if hint == Byte:
        return idl.uint8
    if get_origin(hint) is tuple:
        return idl.sequence[_dds_type(get_args(hint)[0])]
    if dataclasses.is_dataclass(hint):
        return dds_class(hint)
    return {str: str, bool: bool, float: idl.float64}[hint]
