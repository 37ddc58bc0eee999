"""Remappings and parameters as the command lines of ROS have them, for a ROS 2 without rclpy. Pure but for files.

Source: ROS 2 design, "ROS Command Line Arguments" and "Remapping Names".
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from hvcpd.config.document import read_bytes
from hvcpd.errors import ConfigError

FLAGS_WITH_VALUE = {"-r": "remap", "--remap": "remap", "-p": "param", "--param": "param", "--params-file": "file"}
LOGS = ("rosout", "stdout", "external-lib")
IGNORED = {f"--{switch}-{logs}-logs": 0 for switch in ("enable", "disable") for logs in LOGS}
IGNORED |= {"--log-level": 1, "--log-config-file": 1, "--log-file-name": 1, "--enclave": 1, "-e": 1}
"""What a launch file may give that means nothing here, with how many words follow it."""


@dataclass(frozen=True)
class RosArguments:
    """A node's name and namespace, the topics that have other names, and its parameters."""

    node: str
    namespace: str = "/"
    remaps: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, object] = field(default_factory=dict)

    def resolve(self, name: str) -> str:
        """The full name of a topic."""
        names = {self._whole(old): self._whole(new) for old, new in self.remaps.items()}
        whole = self._whole(name)
        return names.get(whole, whole)

    def _whole(self, name: str) -> str:
        if name.startswith("/"):
            return name
        base = self.namespace.rstrip("/")
        return f"{base}/{self.node}/{name[2:]}" if name.startswith("~/") else f"{base}/{name}"


def ros2_words(remaps: Iterable[str], ros_args: Sequence[str]) -> list[str]:
    """One command line as ROS 2 has it, from remappings as ROS 1 has them (`_name:=` sets a parameter) and its own."""
    words = []
    for each in remaps:
        is_parameter = each.startswith("_") and not each.startswith("__")
        words += ["-p", each[1:]] if is_parameter else ["-r", each]
    words += ros_args
    return ["--ros-args", *words] if words else []


def parse_ros_arguments(words: Sequence[str], node: str) -> RosArguments:
    """What a command line after "--ros-args" says. Raises ConfigError for a word that it cannot have."""
    found: dict[str, list[str]] = {"remap": [], "param": [], "file": []}
    left = [word for word in words if word not in ("--ros-args", "--")]
    while left:
        flag = left.pop(0)
        if flag in IGNORED:
            del left[: IGNORED[flag]]
        elif flag not in FLAGS_WITH_VALUE or not left:
            raise ConfigError(
                f"--ros-args: what is {flag!r}? Known are -r NAME:=OTHER, -p NAME:=VALUE, --params-file FILE"
            )
        else:
            found[FLAGS_WITH_VALUE[flag]].append(left.pop(0))
    remaps = dict(_pair(each) for each in found["remap"])
    node = remaps.pop("__node", remaps.pop("__name", node))
    namespace = "/" + remaps.pop("__ns", "/").strip("/")
    parameters: dict[str, object] = {}
    for file in found["file"]:
        parameters |= _from_file(Path(file), (node, f"{namespace.rstrip('/')}/{node}", "/**"))
    for each in found["param"]:
        name, text = _pair(each)
        parameters[name] = _value(text)
    parameters.pop("use_sim_time", None)  # this node has no clock but the system's
    return RosArguments(node, namespace, remaps, parameters)


def _pair(text: str) -> tuple[str, str]:
    name, sign, value = text.partition(":=")
    if not (name and sign and value):
        raise ConfigError(f"--ros-args: {text!r} is not NAME:=VALUE")
    return name.split(":")[-1], value  # "node:name:=value" is meant for one node: this one is alone


def _value(text: str) -> object:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        raise ConfigError(f"--ros-args: {text!r} is not a value in YAML") from None


def _from_file(path: Path, nodes: Sequence[str]) -> dict[str, object]:
    try:
        document = yaml.safe_load(read_bytes(path))
    except yaml.YAMLError as error:
        raise ConfigError(f"{path}: {error}") from None
    found: dict[str, object] = {}
    for name, part in (document if isinstance(document, dict) else {}).items():
        if name in nodes and isinstance(part, dict) and isinstance(part.get("ros__parameters"), dict):
            found |= part["ros__parameters"]
    return found
