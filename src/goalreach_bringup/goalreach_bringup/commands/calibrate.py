"""The `calibrate` command: drives a square, and writes the calibrated parameters."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
import tempfile
from typing import Final

from goalreach_bringup.commands.check_robot import RobotOptions, expected_robot, show
from goalreach_bringup.robot_check.verdicts import WRONG, judge
from goalreach_evaluation.choices import arena_option, choose_arena
from goalreach_learning.controller_config import ControllerConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.files import require_writable
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.options import option
from goalreach_msgs_py.parameter_file import (
    NodeParameters,
    merge_parameters,
    read_parameters,
    write_parameters,
)
from goalreach_msgs_py.parameters import build_config, flatten_config
from goalreach_msgs_py.topics import CONTROLLER, LOCALIZER
from goalreach_perception.calibration import Calibration, calibrate
from goalreach_perception.calibration_model import DriveRecord
from goalreach_perception.localizer_config import LocalizerConfig

SUMMARY = 'Drive a square, and write mount, survey, odometry and delay of a robot as parameters'
_LISTEN_S: Final = 3.0
_CRUISE_M_PER_S, _STEERING_RAD_PER_S, _ALIGNED_RAD = 0.3, 0.5, 0.05
_DOUBTS: Final = {
    'noise.pan_tilt_noise_rad': 0.02,
    'noise.pan_tilt_bias_rad': 0.02,
    'noise.odometry_scale_error': 0.03,
    'noise.camera_height_error_m': 0.03,
    'noise.survey_error_m': 0.01,
    'filter.mount_sigma_m': 0.05,
}
"""Errors that the localizer expects at least on the drive, to recognise the landmarks of a robot
that is not calibrated. Chosen: a delay of 60 ms turns the head by 0.02 rad."""


@dataclass(frozen=True, kw_only=True)
class Options(RobotOptions):
    """Options of the command."""

    side: float = option(1.0, 'side of the square, metres', metavar='M', minimum=0.3, maximum=10.0)
    arena: str = arena_option()
    out: Path = option(Path('calibrated.yaml'), 'parameter file to write')


def execute(options: Options) -> int:
    """Drive, print a line for each value and write them; return 0 where the model fits, else 1."""
    require_writable(options.out)
    if options.out.exists():
        raise FileFormatError(options.out, 'exists already')
    user = read_parameters(options.params_file, options.namespace)
    arena = choose_arena(options.arena)
    defaults = flatten_config(LocalizerConfig.for_arena(arena, noise_preset('nominal')))
    config = build_config(LocalizerConfig, {**defaults, **user[LOCALIZER]})
    record = _drive(options, arena, user, config)
    if record is None:
        return 1
    found = calibrate(record, config)
    lines = [*_lines(found)]
    print(*lines, sep='\n')
    if not found.usable:
        print(f'{options.out} is not written')
        return 1
    given = {node: values for node, values in user.items() if values}
    parameters = merge_parameters(given, {LOCALIZER: found.parameters})
    write_parameters(options.out, parameters, options.namespace, comments=lines)
    print(options.out)
    return int(bool(found.misfits))


def _drive(
    options: Options, arena: Arena, user: NodeParameters, config: LocalizerConfig
) -> DriveRecord | None:
    """Check the robot and drive it; print what is wrong where it cannot drive."""
    from goalreach_bringup.robot_check.ros.listener import CalibrationDrive
    from goalreach_msgs_py.ros.node import ros_session

    given = flatten_config(config)
    doubts = {name: max(given[name], least) for name, least in _DOUBTS.items()}
    control = build_config(ControllerConfig, user[CONTROLLER])
    control = replace(
        control,
        align_tolerance_rad=max(control.align_tolerance_rad, _ALIGNED_RAD),
        cruise_speed_m_per_s=min(control.cruise_speed_m_per_s, _CRUISE_M_PER_S),
        steering_limit_rad_per_s=min(control.steering_limit_rad_per_s, _STEERING_RAD_PER_S),
    )
    robot = expected_robot(user)
    with tempfile.TemporaryDirectory() as folder:
        path, space = f'{folder}/localizer.yaml', options.namespace
        write_parameters(path, {LOCALIZER: {**user[LOCALIZER], **given, **doubts}}, space)
        arguments = ['--ros-args', '--params-file', path, '--log-level', 'error']
        arguments += ['-r', f'__ns:=/{space}'] if space else []
        with ros_session(arguments):
            drive = CalibrationDrive(space, robot)
            drive.listen(_LISTEN_S)
            if wrong := [verdict for verdict in judge(robot) if verdict.level == WRONG]:
                show(wrong)
                return None
            return drive.drive(arena, options.side, control)


def _lines(found: Calibration) -> Iterator[str]:
    """Yield a line for each value, and the verdict."""
    for one in found.values:
        result = f'{one.value:10.5f} +- {one.sigma:.5f}, given {one.given:.5f}'
        if not one.observed:
            result = f'{one.given:10.5f} as given: not observable on this drive'
        yield f'{one.name:<26} {result}'
    residual = f'{found.residual_px:.2f} px, expected {found.expected_px:.2f} px'
    yield f'residuals {residual}: {"; ".join(found.misfits) or "it fits"}'
