"""The `ros2` command: runs the real `ros2` where installed, else its built-in subset."""

from dataclasses import dataclass
import os
import shutil
import sys
from typing import Final

from goalreach_msgs_py.options import option

SUMMARY: str = 'Inspect the running graph as ros2 does: topic, node, param, service'

_HANDED_OVER: Final = 'GOALREACH_ROS2_HANDED_OVER'
"""Set for the `ros2` that is started, in case it is a wrapper that comes back here."""

_WHEELS_GUARD: Final = '_ROS_WHEELS_BOOTSTRAP_COMPLETE'
"""Set by the ROS wheels for their own interpreter; another one would not set itself up."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Arguments that are left to the parser of `ros2`."""

    arguments: tuple[str, ...] = option(
        (),
        'as for ros2, such as: topic list -t; topic echo /pose; param get /nomad200 speed; '
        'each level has its own --help',
        positional=True,
        remainder=True,
    )


def execute(options: Options) -> int:
    """Run the command and return its exit status; does not return where it runs the real ros2."""
    real = shutil.which('ros2')
    if real is not None and _HANDED_OVER not in os.environ:
        sys.stdout.flush()
        os.execve(real, ['ros2', *options.arguments], _environment_of_another_python())  # noqa: S606
    from goalreach_bringup.ros2cli.main import main

    return main(list(options.arguments))


def _environment_of_another_python() -> dict[str, str]:
    """Return the environment without what the ROS wheels put there for this interpreter."""
    environment = {**os.environ, _HANDED_OVER: '1'}
    environment.pop(_WHEELS_GUARD, None)
    paths = environment.pop('LD_LIBRARY_PATH', '').split(os.pathsep)
    foreign = [path for path in paths if path and not path.startswith(sys.prefix + os.sep)]
    if foreign:
        environment['LD_LIBRARY_PATH'] = os.pathsep.join(foreign)
    return environment
