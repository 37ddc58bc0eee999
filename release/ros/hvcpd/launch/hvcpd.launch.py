"""ROS 2: bridge the robot whose hvcpd runs on this computer. `ros2 launch hvcpd hvcpd.launch.py robot:=Rob`"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.launch_context import LaunchContext
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode
from launch_ros.parameter_descriptions import ParameterValue

TYPES = {"odom_frame": str, "base_frame": str, "map_frame": str, "publish_tf": bool, "action": str, "autostart": bool}
"""Of the node's parameters."""


def _bridge(context: LaunchContext) -> list[LifecycleNode]:
    """One managed node, told only what was given."""
    given = {"--name": LaunchConfiguration("robot"), "--socket": LaunchConfiguration("socket")}
    words = [word for option, value in given.items() if value.perform(context) for word in (option, value)]
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in TYPES.items()}
    return [
        LifecycleNode(
            package="hvcpd",
            executable="bridge",
            name="hvcpd",
            namespace="",
            arguments=["--ros", "2", *words],
            parameters=[parameters],
            output="screen",
            respawn=True,
            respawn_delay=2.0,
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """`robot` empty: the one of hvcpd's settings, or the only one that runs here."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("robot", default_value="", description="its name"),
            DeclareLaunchArgument("socket", default_value="", description="its control socket, if that lies elsewhere"),
            DeclareLaunchArgument("odom_frame", default_value="odom"),
            DeclareLaunchArgument("base_frame", default_value="base_link"),
            DeclareLaunchArgument("map_frame", default_value="map"),
            DeclareLaunchArgument("publish_tf", default_value="true", description="if hvcpd has the wheels"),
            DeclareLaunchArgument("action", default_value="", description="where goals go; empty: navigate_to_pose"),
            DeclareLaunchArgument("autostart", default_value="true", description="become active at once"),
            OpaqueFunction(function=_bridge),
        ]
    )
