"""`ros2 launch goalreach_bringup page.launch.py`: the live page of a graph that runs."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration
from launch_ros.substitutions import ExecutableInPackage

OPTIONS = {'robot': '', 'arena': 'paper', 'host': '127.0.0.1', 'port': '0'}


def generate_launch_description():
    """Declare the options of `goalreach dashboard`, with their defaults, and start it."""
    arguments = [DeclareLaunchArgument(name, default_value=OPTIONS[name]) for name in OPTIONS]
    words = [word for name in OPTIONS for word in (f'--{name}', LaunchConfiguration(name))]
    program = ExecutableInPackage('goalreach', 'goalreach_bringup')  # lib/ is not on PATH
    return LaunchDescription([*arguments, ExecuteProcess(cmd=[program, 'dashboard', *words])])
