"""`ros2 launch goalreach_bringup goalreach.launch.py`: the four nodes of `goalreach run`.

The arguments are options of `run`, with its parameters, and the policy of the paper by default.
Judging, recording and restarting nodes are left to `run`.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from goalreach_bringup.cli import load_command
from goalreach_bringup.launch.child_process import NODE_CLASSES
from goalreach_bringup.launch.environment import make_run_directory
from goalreach_bringup.launch.plan import standalone_parameters
from goalreach_msgs_py.parameter_file import write_parameters

OPTIONS = ('mode', 'arena', 'clock', 'speed', 'policy', 'seed', 'namespace', 'params-file')
OTHERS = ('external', 'rviz')
NODES = {name: place.partition('.')[0] for name, place in NODE_CLASSES.items()}
SHARE = Path(__file__).parents[1]


def nodes(context):
    """Return the actions for the given arguments."""
    given = {name: LaunchConfiguration(name).perform(context) for name in (*OPTIONS, *OTHERS)}
    words = [word for name in OPTIONS if given[name] for word in (f'--{name}', given[name])]
    names = filter(None, given['external'].split(','))
    words += [word for name in names for word in ('--external', name)]
    _, options = load_command('run').parse('goalreach.launch.py', words)
    space = options.namespace
    path = make_run_directory() / 'parameters.yaml'
    write_parameters(path, standalone_parameters(options), space)
    actions = [
        Node(package=NODES[name], executable=name, namespace=space, parameters=[str(path)])
        for name in NODES
        if name not in options.external
    ]
    if given['rviz'].lower() in ('true', '1'):
        prefix = f'{space}/'.lstrip('/')
        urdf = (SHARE / 'urdf' / 'nomad200.urdf').read_text()
        robot = {'robot_description': urdf, 'frame_prefix': prefix}
        unused = [(name, f'unused{name}') for name in ('/tf', '/tf_static')]  # of nomad200
        name = 'robot_state_publisher'
        describe = {'namespace': space, 'parameters': [robot], 'remappings': unused}
        actions.append(Node(package=name, executable=name, **describe))
        view = ['-d', str(SHARE / 'rviz' / 'goalreach.rviz'), '-f', f'{prefix}map']
        actions.append(Node(package='rviz2', executable='rviz2', namespace=space, arguments=view))
    return actions


def generate_launch_description():
    """Declare the arguments, empty for the defaults of `run`, and start the nodes."""
    names = (*OPTIONS, *OTHERS)
    arguments = [DeclareLaunchArgument(name, default_value='') for name in names]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
