"""Selects the environment that a command runs in, and makes one where there is none.

In this order, the first that fits:

1. the Python that runs has goalreach and rclpy: it is used as it is;
2. it has rclpy alone (a sourced ROS 2 workspace): the folders under `src/` join its path;
3. `.venv` in the repository's root, made or completed from the locks where that is needed.

Only standard library here: nothing else is installed yet.
"""

from collections.abc import Mapping
import importlib.util
import os
from pathlib import Path
import subprocess
import sys
from typing import NoReturn

from _venv import FOREIGN_VARIABLES, STDERR, SetupError, State, Venv, say

ROOT = Path(__file__).resolve().parent.parent

# Modules that a command may import, and the distributions that hold them.
DEPENDENCIES = {
    'argcomplete': 'argcomplete',
    'cv2': 'opencv-python-headless',
    'matplotlib': 'matplotlib',
    'mcap': 'mcap',
    'numpy': 'numpy',
    'psutil': 'psutil',
    'rich': 'rich',
    'rosbags.rosbag2': 'rosbags',
    'yaml': 'pyyaml',
    'zstandard': 'zstandard',
}
DISTRIBUTION = 'jazzy'


def run(command: str) -> NoReturn:
    """Run `goalreach COMMAND` with this process's arguments.

    Args:
        command: Name of the command, as in `goalreach --help`.

    Raises:
        SystemExit: Always, with the status of the command.
    """
    page = command == 'run' and ('--dashboard' in sys.argv or (sys.stdout and sys.stdout.isatty()))
    prepare(group='page' if page or command == 'dashboard' else 'run')
    from goalreach_bringup import cli

    raise SystemExit(cli.main([command, *sys.argv[1:]]))


def prepare(root: Path = ROOT, *, group: str = 'run') -> None:
    """Return in a Python that can import goalreach, or leave with one clear line.

    Args:
        root: Root of the repository.
        group: What it must hold, a key of `LOCKS`; 'dev' also brings the laboratory and the
            helpers of the tests onto the path.

    Raises:
        SystemExit: No environment can be found or made.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= STDERR:  # closed: `>&-`
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    folder = str(Path(__file__).resolve().parent)  # goes last, where it can hide no library
    sys.path[:] = [entry for entry in sys.path if entry != folder] + [folder]
    try:
        _prepare(root, Venv(root, group))
    except SetupError as error:
        say(str(error))
        raise SystemExit(error.status) from None
    except PermissionError as error:
        say(f'{error.filename}: {error.strerror}: clone the repository as the user who runs it')
        raise SystemExit(1) from None
    if group == 'dev':
        _extend_path([str(root / 'lab'), str(root / 'test' / 'support')])


def importable(module: str) -> bool:
    """Return whether a module can be found, without importing it."""
    try:
        spec = importlib.util.find_spec(module)
    except ModuleNotFoundError:  # of the package that would hold it
        return False
    return spec is not None and spec.origin is not None


def for_another_python(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment variables without those that belong to this Python alone."""
    return {name: value for name, value in environment.items() if name not in FOREIGN_VARIABLES}


def _prepare(root: Path, venv: Venv) -> None:
    inside = Path(sys.prefix).resolve() == venv.path.resolve()
    distribution = os.environ.get('ROS_DISTRO')
    if distribution != DISTRIBUTION and any(map(_holds_ros, _search_path())):
        say(f'ROS_DISTRO = {distribution}: using .venv instead of the ROS that is sourced')
        _continue_in(venv)
    state = venv.state()
    if inside and state is State.READY and not _usable():
        raise SetupError(f'{venv.path} is damaged: remove it, then start the same command again.')
    if inside and state in (State.INCOMPLETE, State.ABSENT):
        _continue_in(venv)
    if _usable():
        _report_other_installation(root)
    elif importable('rclpy'):
        _use_workspace(root)
    elif inside:
        raise SetupError(_foreign(venv))
    else:
        _continue_in(venv)


def _usable() -> bool:
    return importable('goalreach_bringup') and importable('rclpy')


def _search_path() -> list[str]:
    return [entry for entry in os.environ.get('PYTHONPATH', '').split(os.pathsep) if entry]


def _holds_ros(folder: str) -> bool:
    return Path(folder, 'rclpy').is_dir()


def _report_other_installation(root: Path) -> None:
    spec = importlib.util.find_spec('goalreach_bringup')
    origin = Path(spec.origin if spec and spec.origin else root).resolve()
    if root not in origin.parents:
        say(f'using goalreach as installed in {origin.parent.parent}')


def _use_workspace(root: Path) -> None:
    if _fails(sys.executable, 'import rclpy'):
        message = (
            f'the rclpy on the path cannot be imported by {sys.executable}: start with the '
            'Python it was built for, or in a terminal where no ROS is sourced.'
        )
        raise SetupError(message)
    missing = ' '.join(name for module, name in DEPENDENCIES.items() if not importable(module))
    if missing:
        message = (
            f'this ROS environment lacks {missing}: install them with `{sys.executable} -m pip '
            f'install {missing}`, or start in a terminal where no ROS is sourced.'
        )
        raise SetupError(message)
    _extend_path([str(manifest.parent) for manifest in sorted(root.glob('src/*/package.xml'))])


def _extend_path(folders: list[str]) -> None:
    """Add folders to the import path of this process and of those that it starts."""
    sys.path[:0] = folders
    inherited = [os.environ['PYTHONPATH']] if os.environ.get('PYTHONPATH') else []
    os.environ['PYTHONPATH'] = os.pathsep.join(folders + inherited)


def _continue_in(venv: Venv) -> NoReturn:
    if venv.state() is not State.FOREIGN:
        venv.ensure()
    elif not venv.python.exists() or _fails(str(venv.python), 'import goalreach_bringup, rclpy'):
        raise SetupError(_foreign(venv))
    environment = for_another_python(os.environ)
    if folders := [folder for folder in _search_path() if not _holds_ros(folder)]:
        environment['PYTHONPATH'] = os.pathsep.join(folders)
    if any(map(_holds_ros, _search_path())):  # the ros2 on PATH lives from what is left out
        environment['GOALREACH_ROS2_HANDED_OVER'] = '1'
    python = str(venv.python)
    os.execve(python, [python, *sys.orig_argv[1:]], environment)  # noqa: S606


def _fails(python: str, code: str) -> bool:
    environment = for_another_python(os.environ) if python != sys.executable else None
    probe = subprocess.run([python, '-c', code], capture_output=True, check=False, env=environment)
    return probe.returncode != 0


def _foreign(venv: Venv) -> str:
    return (
        f'{venv.path} was not made by these scripts and cannot import goalreach: install it '
        'there (CONTRIBUTING.md), or move that folder away, then start the same command again.'
    )
