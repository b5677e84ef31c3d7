"""`goalreach ros2`: the real `ros2` where it is installed, else the part of it that is here."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from typing import Final

SUMMARY: str = 'look at the running graph with the words of ros2: topic, node, param, service'

_HANDED_OVER: Final = 'GOALREACH_ROS2_HANDED_OVER'
"""Set for the `ros2` that is started, in case it is a wrapper that comes back here."""

_WHEELS_GUARD: Final = '_ROS_WHEELS_BOOTSTRAP_COMPLETE'
"""Set by the ROS wheels for their own interpreter; another one would not set itself up."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments, all of which are for `ros2`."""
    parser.epilog = 'For example: topic list -t; topic echo /pose; param get /nomad200 speed'
    parser.add_argument(
        'arguments',
        nargs=argparse.REMAINDER,
        help='as for ros2; each level has its own --help',
    )


def execute(args: argparse.Namespace) -> int:
    """Run the command and return its exit status; does not return if it hands over."""
    real = shutil.which('ros2')
    if real is not None and _HANDED_OVER not in os.environ:
        sys.stdout.flush()
        os.execve(real, ['ros2', *args.arguments], _environment_of_another_python())  # noqa: S606
    from goalreach_bringup.ros2cli.main import main

    return main(args.arguments)


def _environment_of_another_python() -> dict[str, str]:
    """Return the environment without what the ROS wheels put there for this interpreter."""
    environment = {**os.environ, _HANDED_OVER: '1'}
    environment.pop(_WHEELS_GUARD, None)
    paths = environment.pop('LD_LIBRARY_PATH', '').split(os.pathsep)
    foreign = [path for path in paths if path and not path.startswith(sys.prefix + os.sep)]
    if foreign:
        environment['LD_LIBRARY_PATH'] = os.pathsep.join(foreign)
    return environment
