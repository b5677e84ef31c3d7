"""The `check-robot` command: checks whether a robot fits the nodes."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from goalreach_bringup.launch.plan import require_known
from goalreach_bringup.robot_check.verdicts import HeardRobot, Verdict, can_drive, judge
from goalreach_evaluation.summary_file import write_summary
from goalreach_learning.controller_config import RobotConfig
from goalreach_msgs_py.files import require_writable
from goalreach_msgs_py.options import CommandOptions, option, parse_namespace
from goalreach_msgs_py.parameter_file import NodeParameters, read_parameters
from goalreach_msgs_py.parameters import build_config
from goalreach_msgs_py.topics import CONTROLLER, LOCALIZER
from goalreach_perception.localizer_config import InputConfig

SUMMARY = 'Check the inputs of a robot, and report what is missing or wrong and how to correct it'
_STYLES: Final = {'ok': 'green', 'note': '', 'warn': 'yellow', 'wrong': 'bold red'}


@dataclass(frozen=True, kw_only=True)
class RobotOptions(CommandOptions):
    """Namespace and known parameters of a robot."""

    params_file: Path | None = option(
        None, 'ROS 2 parameter file of the nodes, as for run', metavar='YAML'
    )
    namespace: str = option('', 'namespace of the robot', metavar='NAME', parse=parse_namespace)


@dataclass(frozen=True, kw_only=True)
class Options(RobotOptions):
    """Options of the command."""

    duration: float = option(5.0, 'time to listen, seconds', metavar='S', minimum=1.0)
    move: bool = option(
        False, 'also turn the head by 10 degrees, drive 0.1 m and turn by 10 degrees'
    )
    json: Path | None = option(None, 'write the verdicts', metavar='FILE')


def execute(options: Options) -> int:
    """Listen and print a line for each finding; return 0 where the robot can drive, else 1."""
    from goalreach_bringup.robot_check.ros.listener import RobotListener
    from goalreach_msgs_py.ros.node import ros_session

    if options.json:
        require_writable(options.json)
    robot = expected_robot(read_parameters(options.params_file, options.namespace))
    with ros_session():
        listener = RobotListener(options.namespace, robot)
        listener.listen(options.duration)
        verdicts = judge(robot)
        if options.move and can_drive(verdicts):
            verdicts += listener.move()
    show(verdicts)
    drives = can_drive(verdicts)
    if options.json:
        found = {'can_drive': drives, 'verdicts': [asdict(verdict) for verdict in verdicts]}
        write_summary(options.json, found)
    return 0 if drives else 1


def expected_robot(user: NodeParameters) -> HeardRobot:
    """Return the robot that parameters describe, without messages so far."""
    require_known(user)
    return HeardRobot(
        build_config(InputConfig, user[LOCALIZER]), build_config(RobotConfig, user[CONTROLLER])
    )


def show(verdicts: list[Verdict]) -> None:
    """Print a line for each verdict."""
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=True)
    for verdict in verdicts:
        cure = f'; {verdict.cure}' if verdict.cure else ''
        line = f'{verdict.level:<7}{verdict.subject:<30}{verdict.text}{cure}'
        console.print(line, markup=False, style=_STYLES[verdict.level])
