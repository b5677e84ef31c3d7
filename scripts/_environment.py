"""Finds the environment a command runs in, and makes one where there is none.

In this order, the first that fits:

1. the Python that runs has goalreach and rclpy: it is used as it is;
2. it has rclpy alone (a sourced ROS 2 workspace): the folders under ``src/`` join its path;
3. ``.venv`` in the repository's root, made or renewed from the lock where that is needed.

Only standard library here: nothing else is installed yet.
"""

from collections.abc import Mapping
import importlib.util
import os
from pathlib import Path
import subprocess
import sys
from typing import NoReturn

from _install import SetupError, say
from _venv import State, Venv

ROOT = Path(__file__).resolve().parent.parent

# Modules that a command may import, and the distributions that hold them.
DEPENDENCIES = {
    'cv2': 'opencv-python-headless',
    'matplotlib': 'matplotlib',
    'numpy': 'numpy',
    'rich': 'rich',
    'rosbags.rosbag2': 'rosbags',
    'yaml': 'pyyaml',
}

# They name another environment's libraries, and would hide those of the one that is started.
FOREIGN_VARIABLES = ('_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'LD_LIBRARY_PATH')


def run(command: str) -> NoReturn:
    """Run ``goalreach COMMAND`` with this process's arguments, where it can run.

    Args:
        command: Name of the command, as in ``goalreach --help``.

    Raises:
        SystemExit: Always, with the status of the command.
    """
    prepare()
    from goalreach_bringup import cli

    raise SystemExit(cli.main([command, *sys.argv[1:]]))


def prepare(root: Path = ROOT, *, lab: bool = False) -> None:
    """Return in a Python that can import goalreach, or leave with one clear line.

    Args:
        root: Root of the repository.
        lab: Whether this process, and those that it starts, import what is in `lab/` too.

    Raises:
        SystemExit: Where no environment can be found or made.
    """
    _scripts_last()
    try:
        _prepare(root)
    except SetupError as error:
        say(str(error))
        raise SystemExit(error.status) from None
    if lab:
        _extend_path([str(root / 'lab')])


def importable(module: str) -> bool:
    """Tell whether a module can be found, without importing it."""
    try:
        spec = importlib.util.find_spec(module)
    except ModuleNotFoundError:  # of the package that would hold it
        return False
    return spec is not None and spec.origin is not None


def missing_dependencies() -> list[str]:
    """Return the distributions this Python lacks, by name."""
    return [name for module, name in DEPENDENCIES.items() if not importable(module)]


def for_another_python(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment variables without those that belong to this Python alone."""
    return {name: value for name, value in environment.items() if name not in FOREIGN_VARIABLES}


def source_folders(root: Path) -> list[str]:
    """Return the folders under ``src/`` that hold a package each."""
    return [str(manifest.parent) for manifest in sorted(root.glob('src/*/package.xml'))]


def _prepare(root: Path) -> None:
    venv = Venv(root)
    inside = Path(sys.prefix).resolve() == venv.path.resolve()
    state = venv.state()
    if inside and state is State.READY and not _usable():
        message = f'{venv.path} is damaged: remove it, then start the same command again.'
        raise SetupError(message)
    if inside and state in (State.INCOMPLETE, State.ABSENT):
        _continue_in(venv)
    if _usable():
        _mention_another_clone(root)
    elif importable('rclpy'):
        _use_workspace(root)
    elif inside:
        raise SetupError(_foreign(venv))
    else:
        _continue_in(venv)


def _usable() -> bool:
    return importable('goalreach_bringup') and importable('rclpy')


def _mention_another_clone(root: Path) -> None:
    spec = importlib.util.find_spec('goalreach_bringup')
    origin = Path(spec.origin if spec and spec.origin else root).resolve()
    if root not in origin.parents:
        say(f'using goalreach as installed in {origin.parent.parent}')


def _use_workspace(root: Path) -> None:
    probe = [sys.executable, '-c', 'import rclpy']
    if subprocess.run(probe, capture_output=True, check=False).returncode:
        message = (
            f'the rclpy on the path cannot be imported by {sys.executable}: start with the '
            'Python it was built for, or in a terminal where no ROS is sourced.'
        )
        raise SetupError(message)
    missing = missing_dependencies()
    if missing:
        names = ' '.join(missing)
        message = (
            f'this ROS environment lacks {names}: install them with `{sys.executable} -m pip '
            f'install {names}`, or start in a terminal where no ROS is sourced.'
        )
        raise SetupError(message)
    _extend_path(source_folders(root))


def _extend_path(folders: list[str]) -> None:
    """Add folders to the import path of this process and of those that it starts."""
    sys.path[:0] = folders
    inherited = [os.environ['PYTHONPATH']] if os.environ.get('PYTHONPATH') else []
    os.environ['PYTHONPATH'] = os.pathsep.join(folders + inherited)


def _continue_in(venv: Venv) -> NoReturn:
    if venv.state() is State.FOREIGN:
        probe = [str(venv.python), '-c', 'import goalreach_bringup, rclpy']
        environment = for_another_python(os.environ)
        if (
            not venv.python.exists()
            or subprocess.run(probe, capture_output=True, check=False, env=environment).returncode
        ):
            raise SetupError(_foreign(venv))
    else:
        venv.ensure()
    sys.stdout.flush()
    sys.stderr.flush()
    python = str(venv.python)
    os.execve(python, [python, *sys.orig_argv[1:]], for_another_python(os.environ))  # noqa: S606


def _foreign(venv: Venv) -> str:
    return (
        f'{venv.path} was not made by these scripts and cannot import goalreach: install it '
        'there (CONTRIBUTING.md), or move that folder away, then start the same command again.'
    )


def _scripts_last() -> None:
    """Move this folder to the end of the path, where its names can hide no library."""
    folder = str(Path(__file__).resolve().parent)
    sys.path[:] = [entry for entry in sys.path if entry != folder] + [folder]
