"""The ROS messages that the bridge speaks, as plain frozen data; units and axes by REP-103.

Fields have the names, the order and the types of ROS's own definitions (common_interfaces, geometry2), which ROS 1 and
ROS 2 share but for `Time` and the sequence number of ROS 1's header. Adapters turn them into the messages of the ROS
that is there (`convert.py`). Numbers without a width here are float64. Those of `hvcpd_msgs` are our own; its
definitions for ROS are in `release/ros/hvcpd_msgs`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

Int32 = Annotated[int, "int32"]
Uint32 = Annotated[int, "uint32"]
Byte = Annotated[int, "byte"]
COVARIANCE_SIZE = 36
"""6 by 6, row by row, of x, y, z and the turns about them (geometry_msgs)."""
Covariance = Annotated[tuple[float, ...], COVARIANCE_SIZE]
UNKNOWN_COVARIANCE: tuple[float, ...] = (0.0,) * COVARIANCE_SIZE
"""All zeros: not known, as the definitions of ROS's sensor messages have it. Nobody has measured it."""


@dataclass(frozen=True)
class Time:
    """Since 1970, or what the ROS clock says."""

    ROS_TYPE: ClassVar = "builtin_interfaces/Time"
    sec: Int32 = 0
    nanosec: Uint32 = 0

    @classmethod
    def of(cls, seconds: float) -> Time:
        """The time in seconds; 0 or later."""
        whole = math.floor(seconds)
        nanosec = min(round((seconds - whole) * 1e9), 999_999_999)
        return cls(whole, nanosec)


@dataclass(frozen=True)
class Header:
    """When, and in which frame."""

    ROS_TYPE: ClassVar = "std_msgs/Header"
    stamp: Time = Time()
    frame_id: str = ""


@dataclass(frozen=True)
class String:
    """Text."""

    ROS_TYPE: ClassVar = "std_msgs/String"
    data: str = ""


@dataclass(frozen=True)
class Bool:
    """Yes or no."""

    ROS_TYPE: ClassVar = "std_msgs/Bool"
    data: bool = False


@dataclass(frozen=True)
class Vector3:
    """m, m/s or rad/s."""

    ROS_TYPE: ClassVar = "geometry_msgs/Vector3"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Point:
    """A place, m."""

    ROS_TYPE: ClassVar = "geometry_msgs/Point"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Quaternion:
    """A rotation; the default is none."""

    ROS_TYPE: ClassVar = "geometry_msgs/Quaternion"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0

    @classmethod
    def about_z(cls, heading_rad: float) -> Quaternion:
        """A heading on the floor, counter-clockwise positive."""
        return cls(z=math.sin(heading_rad / 2.0), w=math.cos(heading_rad / 2.0))

    @property
    def heading_rad(self) -> float:
        """The turn about the vertical axis, within [-pi, pi]."""
        return math.atan2(2.0 * (self.w * self.z + self.x * self.y), 1.0 - 2.0 * (self.y * self.y + self.z * self.z))


@dataclass(frozen=True)
class Pose:
    """Place and direction."""

    ROS_TYPE: ClassVar = "geometry_msgs/Pose"
    position: Point = Point()
    orientation: Quaternion = Quaternion()


@dataclass(frozen=True)
class PoseStamped:
    """A pose in a frame."""

    ROS_TYPE: ClassVar = "geometry_msgs/PoseStamped"
    header: Header = Header()
    pose: Pose = Pose()


@dataclass(frozen=True)
class PoseWithCovariance:
    """A pose and how sure it is."""

    ROS_TYPE: ClassVar = "geometry_msgs/PoseWithCovariance"
    pose: Pose = Pose()
    covariance: Covariance = UNKNOWN_COVARIANCE


@dataclass(frozen=True)
class Twist:
    """Speeds: m/s forward (x), rad/s counter-clockwise (z)."""

    ROS_TYPE: ClassVar = "geometry_msgs/Twist"
    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()


@dataclass(frozen=True)
class TwistWithCovariance:
    """Speeds and how sure they are."""

    ROS_TYPE: ClassVar = "geometry_msgs/TwistWithCovariance"
    twist: Twist = Twist()
    covariance: Covariance = UNKNOWN_COVARIANCE


@dataclass(frozen=True)
class Odometry:
    """Where the base is in its odometry's frame, and how it moves, in its own frame."""

    ROS_TYPE: ClassVar = "nav_msgs/Odometry"
    header: Header = Header()
    child_frame_id: str = ""
    pose: PoseWithCovariance = PoseWithCovariance()
    twist: TwistWithCovariance = TwistWithCovariance()


@dataclass(frozen=True)
class Transform:
    """From one frame to another."""

    ROS_TYPE: ClassVar = "geometry_msgs/Transform"
    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


@dataclass(frozen=True)
class TransformStamped:
    """The frame `child_frame_id` as the header's frame sees it."""

    ROS_TYPE: ClassVar = "geometry_msgs/TransformStamped"
    header: Header = Header()
    child_frame_id: str = ""
    transform: Transform = Transform()


@dataclass(frozen=True)
class TFMessage:
    """Some transforms, for /tf."""

    ROS_TYPE: ClassVar = "tf2_msgs/TFMessage"
    transforms: tuple[TransformStamped, ...] = ()


@dataclass(frozen=True)
class KeyValue:
    """One figure of a diagnosis."""

    ROS_TYPE: ClassVar = "diagnostic_msgs/KeyValue"
    key: str = ""
    value: str = ""


@dataclass(frozen=True)
class DiagnosticStatus:
    """How one part is: OK, WARN, ERROR or STALE."""

    ROS_TYPE: ClassVar = "diagnostic_msgs/DiagnosticStatus"
    OK: ClassVar = 0
    WARN: ClassVar = 1
    ERROR: ClassVar = 2
    STALE: ClassVar = 3
    level: Byte = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: tuple[KeyValue, ...] = ()


@dataclass(frozen=True)
class DiagnosticArray:
    """All parts, for /diagnostics."""

    ROS_TYPE: ClassVar = "diagnostic_msgs/DiagnosticArray"
    header: Header = Header()
    status: tuple[DiagnosticStatus, ...] = ()


@dataclass(frozen=True)
class Word:
    """One word of a sentence; its begin and end in s after the sentence's begin."""

    ROS_TYPE: ClassVar = "hvcpd_msgs/Word"
    text: str = ""
    begin_s: float = 0.0
    end_s: float = 0.0


@dataclass(frozen=True)
class Sentence:
    """A sentence that the robot heard or said. The header's stamp is its begin; NaN: not known."""

    ROS_TYPE: ClassVar = "hvcpd_msgs/Sentence"
    header: Header = Header()
    speaker: str = ""
    text: str = ""
    duration_s: float = math.nan
    confidence: float = math.nan
    snr_db: float = math.nan
    words: tuple[Word, ...] = ()


@dataclass(frozen=True)
class Task:
    """A task by the robot's own view: open, claimed, done or failed, by `owner` ("": nobody)."""

    ROS_TYPE: ClassVar = "hvcpd_msgs/Task"
    number: Int32 = 0
    name: str = ""
    state: str = ""
    owner: str = ""
    has_place: bool = False
    place: Point = Point()


@dataclass(frozen=True)
class TaskArray:
    """All tasks."""

    ROS_TYPE: ClassVar = "hvcpd_msgs/TaskArray"
    header: Header = Header()
    tasks: tuple[Task, ...] = ()


@dataclass(frozen=True)
class RobotState:
    """What the robot is doing: the state of its conversation, in words, and the number of its task (0: none)."""

    ROS_TYPE: ClassVar = "hvcpd_msgs/RobotState"
    header: Header = Header()
    state: str = ""
    doing: str = ""
    task: Int32 = 0


Message = (
    String | Bool | Twist | Odometry | TFMessage | DiagnosticArray | PoseStamped | Sentence | TaskArray | RobotState
)
"""The messages of topics."""
