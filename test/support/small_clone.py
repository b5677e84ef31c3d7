"""A small clone around the real scripts, which sets up in seconds and without a network."""

from dataclasses import dataclass
import hashlib
import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
from typing import Any
import zipfile

from _venv import own_base

SCRIPTS = Path(__file__).resolve().parents[2] / 'scripts'

PYPROJECT = """
[build-system]
requires = []
build-backend = 'backend'
backend-path = ['.']
"""

BACKEND = """
import pathlib, zipfile

def build_editable(folder, config_settings=None, metadata_directory=None):
    name = 'goalreach-1.0-py3-none-any.whl'
    with zipfile.ZipFile(pathlib.Path(folder) / name, 'w') as wheel:
        here = pathlib.Path(__file__).parent
        wheel.writestr('goalreach.pth', str(here / 'src' / 'goalreach_bringup'))
        info = 'goalreach-1.0.dist-info'
        wheel.writestr(f'{info}/METADATA', 'Metadata-Version: 2.1\\nName: goalreach\\nVersion: 1')
        wheel.writestr(f'{info}/WHEEL', 'Wheel-Version: 1.0\\nTag: py3-none-any')
        wheel.writestr(f'{info}/RECORD', '')
    return name
"""

CLI = """
import json, os, sys

HANDED_OVER = 'GOALREACH_ROS2_HANDED_OVER'

def main(arguments):
    names = ('LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'PYTHONPATH', HANDED_OVER)
    print(json.dumps({
        'arguments': arguments,
        'prefix': sys.prefix,
        'variables': {name: os.environ.get(name) for name in names},
        'first': sys.path[0],
    }))
    return 3 if 'fail' in arguments else 0
"""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a started script came to.

    Attributes:
        status: Exit status.
        out: Its stdout.
        err: Its stderr.
        said: What the command reported, empty where it did not run.
    """

    status: int
    out: str
    err: str
    said: dict[str, Any]


class Clone:
    """A repository with the real scripts, a `cli` that reports, and a lock of empty wheels."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.wheels = root.parent / 'wheels'
        self.venv = root / '.venv'
        self.lock = root / 'requirements.lock'
        (root / 'requirements-page.lock').touch()
        (root / 'requirements-dev.lock').touch()
        package = root / 'src' / 'goalreach_bringup'
        (package / 'goalreach_bringup').mkdir(parents=True)
        (package / 'package.xml').touch()
        (package / 'goalreach_bringup' / '__init__.py').touch()
        (package / 'goalreach_bringup' / 'cli.py').write_text(CLI)
        (root / 'pyproject.toml').write_text(PYPROJECT)
        (root / 'backend.py').write_text(BACKEND)
        shutil.copytree(SCRIPTS, root / 'scripts', ignore=shutil.ignore_patterns('__pycache__'))
        self.wheels.mkdir()
        modules = {'setuptools': '', 'wheel': '', 'ros_jazzy_rclpy': 'rclpy/__init__.py'}
        self.lock.write_text(''.join(self.wheel(*item) for item in modules.items()))

    def lock_uv(self) -> None:
        """Put a wheel with the real uv into the lock."""
        uv = Path(sys.executable).with_name('uv')
        name = 'uv-99.0.data/scripts/uv'
        self.lock.write_text(self.lock.read_text() + self.wheel('uv', name, uv.read_bytes()))

    def wheel(self, name: str, module: str, content: bytes = b'') -> str:
        """Build a wheel of one file and return its line for a lock."""
        path = self.wheels / f'{name}-99.0-py3-none-any.whl'
        info = f'{name}-99.0.dist-info'
        with zipfile.ZipFile(path, 'w') as wheel:
            if module:
                entry = zipfile.ZipInfo(module)
                entry.external_attr = 0o100755 << 16
                wheel.writestr(entry, content)
            metadata = f'Metadata-Version: 2.1\nName: {name}\nVersion: 99.0\n'
            wheel.writestr(f'{info}/METADATA', metadata)
            wheel.writestr(f'{info}/WHEEL', 'Wheel-Version: 1.0\nTag: py3-none-any\n')
            wheel.writestr(f'{info}/RECORD', '')
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        return f'{name.replace("_", "-")}==99.0 \\\n    --hash=sha256:{digest}\n'

    def start(
        self, *arguments: str, script: str = 'train.py', redirection: str = '', **variables: str
    ) -> 'subprocess.Popen[str]':
        """Start a script with this environment's base Python, which has no package."""
        shell = ['bash', '-c', f'exec "$@" {redirection}', 'bash']
        environment = {
            'HOME': os.environ.get('HOME', '/'),
            'PATH': os.environ.get('PATH', os.defpath),
            'PIP_CONFIG_FILE': os.devnull,
            'PIP_FIND_LINKS': str(self.wheels),
            'PIP_NO_INDEX': '1',
            'UV_NO_CONFIG': '1',
            'UV_OFFLINE': '1',
            'PYTHONDONTWRITEBYTECODE': '1',
            'PYTHONNOUSERSITE': '1',
            **variables,
        }
        return subprocess.Popen(
            [*shell, own_base(), str(self.root / 'scripts' / script), *arguments],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, *arguments: str, **settings: str) -> Outcome:
        """Start it and wait for what comes of it."""
        return finish(self.start(*arguments, **settings))


def finish(child: 'subprocess.Popen[str]') -> Outcome:
    """Wait for a started command: status, stderr, and what the command reported, if it ran."""
    out, err = child.communicate(timeout=60)
    return Outcome(status=child.returncode, out=out, err=err, said=json.loads(out or '{}'))


def place_package(folder: Path, text: str = '') -> None:
    """Write a package of one file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / '__init__.py').write_text(text)
