"""What differs between distributions: of the one installed, and of Kilted by the names it has.

`kilted_names.txt` holds what Kilted's rclpy offers of what `src` imports. After a new import, look
whether Kilted has it, messages included, and renew the file, by

    GOALREACH_KILTED=PYTHON pytest test/test_distributions.py

where PYTHON is the one of an environment with Kilted's wheels (`docs/how-to/install.md`).
"""

from __future__ import annotations

from importlib.machinery import ModuleSpec
from importlib.metadata import version
import os
from pathlib import Path
import re
import subprocess
import sys

import pytest

import _environment
from architecture import Module, is_ros
from goalreach_msgs_py.ros import distribution
from goalreach_msgs_py.ros.distribution import JAZZY, KILTED, Distribution, installed
from graphs import fresh_domain

ROOT = Path(__file__).resolve().parent.parent
NAMES = ROOT / 'test' / 'support' / 'kilted_names.txt'
OPTIONAL = (
    'ament_index_python',
    'tf2_msgs',
)  # not among the wheels, or not needed
KILTED_PYTHON = os.environ.get('GOALREACH_KILTED')
PROBE = """
import importlib, sys
from goalreach_msgs_py.ros.distribution import installed
assert installed().name == 'kilted', installed()
for line in sys.stdin.read().split():
    module, _, name = line.rpartition('.')
    if hasattr(importlib.import_module(module), name):
        print(line)
"""


def imported() -> set[str]:
    """Return what `src` imports of ROS."""
    modules = [Module(name='', text=path.read_text()) for path in ROOT.glob('src/*/*/**/*.py')]
    names = {name for module in modules for name in module.imports() if '.' in name}
    return {name for name in names if is_ros(name) and not name.startswith(OPTIONAL)}


def test_kilted_has_what_is_imported() -> None:
    names = {name for name in imported() if name.startswith('rclpy.')}
    unknown = names - set(NAMES.read_text().split())
    assert not unknown, f'add them, once Kilted is known to have them, to {NAMES}: {unknown}'


@pytest.mark.skipif(not KILTED_PYTHON, reason='GOALREACH_KILTED is not set')
def test_the_names_are_those_of_kilted() -> None:
    assert KILTED_PYTHON
    environment = _environment.for_another_python(os.environ)
    environment['PYTHONPATH'] = str(ROOT / 'src' / 'goalreach_msgs_py')
    words = '\n'.join(sorted(imported()))
    command = [KILTED_PYTHON, '-c', PROBE]
    found = subprocess.check_output(command, env=environment, input=words, text=True)
    assert found.split() == words.split()
    NAMES.write_text(''.join(f'{name}\n' for name in found.split() if name.startswith('rclpy.')))


PROFILE_PROBE = """
import os, psutil, rclpy
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
use_profile(fast_dds_profile())
rclpy.init()
node = rclpy.create_node('probe')
print(*sorted({one.laddr.ip for one in psutil.Process().net_connections('udp4')}))
rclpy.shutdown()
"""


@pytest.mark.skipif(not KILTED_PYTHON, reason='GOALREACH_KILTED is not set')
def test_a_graph_of_kilted_is_private_to_its_machine(tmp_path: Path) -> None:
    assert KILTED_PYTHON
    environment = _environment.for_another_python(os.environ)
    environment['PYTHONPATH'] = str(ROOT / 'src' / 'goalreach_msgs_py')
    environment |= {'ROS_LOG_DIR': str(tmp_path), 'ROS_DOMAIN_ID': str(fresh_domain())}
    command = [KILTED_PYTHON, '-c', PROFILE_PROBE]
    addresses = subprocess.check_output(command, env=environment, text=True).split()
    assert addresses == ['127.0.0.1', '239.255.0.1']


@pytest.mark.parametrize('name', ['fastdds', 'fastdds_network'])
def test_the_profiles_of_kilted_differ_in_a_spelling(name: str) -> None:
    folder = ROOT / 'src' / 'goalreach_msgs_py' / 'goalreach_msgs_py' / 'config'
    ours = (folder / f'{name}.xml').read_text()
    expected = ours.replace('initialAcknackDelay', 'initial_acknack_delay')
    assert (folder / f'{name}{KILTED.profile_suffix}.xml').read_text() == expected


def test_the_distribution_is_told_by_rclpy() -> None:
    here = installed()
    assert version('rclpy').startswith(f'{here.rclpy_major}.')
    libraries = list(Path(sys.prefix, 'lib').glob('libfast[rd][td][ps]*.so'))
    assert any(here.profile_variable.encode() in each.read_bytes() for each in libraries)


@pytest.mark.parametrize(
    ('folder', 'expected'),
    [
        ('rclpy-7.1.5-py3.12.egg-info', JAZZY),
        ('rclpy-9.1.2-py3.12.egg-info', KILTED),
        ('rclpy-12.0.0.dist-info', KILTED),
        ('other-9.1.2.dist-info', JAZZY),
    ],
)
def test_a_version_of_rclpy_means_a_distribution(
    folder: str, expected: Distribution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    origin = tmp_path / 'rclpy' / '__init__.py'
    (tmp_path / folder).mkdir()
    spec = ModuleSpec('rclpy', None, origin=str(origin))
    monkeypatch.setattr(distribution, 'find_spec', lambda _name: spec)
    assert installed.__wrapped__() is expected


def test_what_is_supported_is_named_once() -> None:
    assert JAZZY.name == _environment.DISTRIBUTION
    wheels = re.findall(r"'ros-(\w+)-rclpy'", (ROOT / 'pyproject.toml').read_text())
    assert wheels == [JAZZY.name]
    quoted = {path for path in ROOT.glob('src/**/*.py') if f"'{JAZZY.name}'" in path.read_text()}
    assert {path.name for path in quoted} == {'distribution.py'}
