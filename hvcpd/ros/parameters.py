"""The bridge's parameters, by ROS conventions private to its node (`~odom_frame` in ROS 1, `odom_frame` in ROS 2)."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from hvcpd.errors import ConfigError, did_you_mean


@dataclass(frozen=True)
class Parameters:
    """Frames by REP-105; `action` is the name of the action that takes goals, empty for the usual one of that ROS."""

    odom_frame: str = "odom"
    base_frame: str = "base_link"
    map_frame: str = "map"
    publish_tf: bool = True
    action: str = ""


NAMES = tuple(each.name for each in dataclasses.fields(Parameters))


def parameters_from(given: Mapping[str, object]) -> Parameters:
    """The parameters that were set, checked. Raises ConfigError with every fault."""
    faults = []
    defaults = Parameters()
    for name, value in given.items():
        if name not in NAMES:
            faults.append(f"unknown parameter {name!r}; {did_you_mean(name, NAMES)}")
        elif type(value) is not type(getattr(defaults, name)):
            wanted = "true or false" if isinstance(getattr(defaults, name), bool) else "text"
            faults.append(f"parameter {name}: expected {wanted}, found {value!r}")
        elif name.endswith("_frame") and (not value or str(value).startswith("/")):
            faults.append(f"parameter {name}: a frame's name is not empty and begins with no slash, found {value!r}")
    if faults:
        raise ConfigError("\n".join(faults))
    return dataclasses.replace(defaults, **dict(given))  # type: ignore[arg-type]
