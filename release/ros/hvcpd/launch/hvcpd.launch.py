"""ROS 2: bridge the robot whose hvcpd runs on this computer. `ros2 launch hvcpd hvcpd.launch.py robot:=Rob`"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import LifecycleNode
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description() -> LaunchDescription:
    """One managed node; `robot` empty: the one of hvcpd's settings, or the only one that runs here."""
    robot = LaunchConfiguration("robot")
    parameters = {
        "odom_frame": LaunchConfiguration("odom_frame"),
        "base_frame": LaunchConfiguration("base_frame"),
        "map_frame": LaunchConfiguration("map_frame"),
        "publish_tf": ParameterValue(LaunchConfiguration("publish_tf"), value_type=bool),
        "action": ParameterValue(LaunchConfiguration("action"), value_type=str),
        "autostart": ParameterValue(LaunchConfiguration("autostart"), value_type=bool),
    }
    named = PythonExpression(["'", robot, "' != ''"])
    bridge = {"package": "hvcpd", "executable": "bridge", "name": "hvcpd", "namespace": "", "parameters": [parameters]}
    bridge |= {"output": "screen", "respawn": True, "respawn_delay": 2.0}
    return LaunchDescription(
        [
            DeclareLaunchArgument("robot", default_value="", description="its name"),
            DeclareLaunchArgument("odom_frame", default_value="odom"),
            DeclareLaunchArgument("base_frame", default_value="base_link"),
            DeclareLaunchArgument("map_frame", default_value="map"),
            DeclareLaunchArgument("publish_tf", default_value="true", description="if hvcpd has the wheels"),
            DeclareLaunchArgument("action", default_value="", description="where goals go; empty: navigate_to_pose"),
            DeclareLaunchArgument("autostart", default_value="true", description="become active at once"),
            LifecycleNode(arguments=["--ros", "2", "--name", robot], condition=IfCondition(named), **bridge),
            LifecycleNode(arguments=["--ros", "2"], condition=UnlessCondition(named), **bridge),
        ]
    )
