"""ROS 2: a TurtleBot3 whose base ROS drives (in hvcpd's settings: `wheels: {driver: ros}`).

With a map Nav2 finds the way (`wheels: {driver: ros, ros_mode: goal}`):
`ros2 launch hvcpd turtlebot3.launch.py map:=map.yaml`
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_context import LaunchContext
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare


def _included(package: str, file: str, **arguments: object) -> IncludeLaunchDescription:
    path = PathJoinSubstitution([FindPackageShare(package), "launch", file])
    return IncludeLaunchDescription(PythonLaunchDescriptionSource(path), launch_arguments=arguments.items())


def _navigation(context: LaunchContext) -> list[IncludeLaunchDescription]:
    """Nav2, if there is a map."""
    room = LaunchConfiguration("map").perform(context)
    return [_included("turtlebot3_navigation2", "navigation2.launch.py", map=room)] if room else []


def generate_launch_description() -> LaunchDescription:
    """Base, bridge, and navigation if there is a map."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("robot", default_value=""),
            DeclareLaunchArgument("map", default_value="", description="a map of the room; empty: by odometry"),
            _included("turtlebot3_bringup", "robot.launch.py"),
            OpaqueFunction(function=_navigation),
            _included("hvcpd", "hvcpd.launch.py", robot=LaunchConfiguration("robot"), base_frame="base_footprint"),
        ]
    )
