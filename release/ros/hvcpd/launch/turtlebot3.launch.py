"""ROS 2: a TurtleBot3 whose base ROS drives (in hvcpd's settings: `wheels: {driver: ros}`).

With a map Nav2 finds the way (`wheels: {driver: ros, ros_mode: goal}`):
`ros2 launch hvcpd turtlebot3.launch.py map:=map.yaml`
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.substitutions import FindPackageShare


def _included(package: str, file: str, **more: object) -> IncludeLaunchDescription:
    path = PathJoinSubstitution([FindPackageShare(package), "launch", file])
    return IncludeLaunchDescription(PythonLaunchDescriptionSource(path), **more)


def generate_launch_description() -> LaunchDescription:
    """Base, bridge, and navigation if there is a map."""
    robot, room = LaunchConfiguration("robot"), LaunchConfiguration("map")
    has_map = IfCondition(PythonExpression(["'", room, "' != ''"]))
    bridge = {"robot": robot, "base_frame": "base_footprint"}
    return LaunchDescription(
        [
            DeclareLaunchArgument("robot", default_value=""),
            DeclareLaunchArgument("map", default_value="", description="a map of the room; empty: by odometry"),
            _included("turtlebot3_bringup", "robot.launch.py"),
            _included(
                "turtlebot3_navigation2",
                "navigation2.launch.py",
                launch_arguments={"map": room}.items(),
                condition=has_map,
            ),
            _included("hvcpd", "hvcpd.launch.py", launch_arguments=bridge.items()),
        ]
    )
