"""What `pip install` brings: the packages with their data, nothing of the laboratory."""

from email.parser import Parser
from pathlib import Path
import re
import shutil
import subprocess
import sys
from zipfile import ZipFile

import pytest

from architecture import PACKAGES

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
_LINES = re.MULTILINE | re.DOTALL
DATA = {
    'goalreach_bringup/config/goalreach.rviz',
    'goalreach_dashboard/static/live.js',
    'goalreach_learning/config/policies/paper.json',
    'goalreach_msgs_py/config/arenas/paper.yaml',
    'goalreach_msgs_py/config/fastdds.xml',
}


@pytest.fixture(scope='module')
def wheel(tmp_path_factory: pytest.TempPathFactory) -> ZipFile:
    """Return the wheel that is built from the source distribution, as everybody's is."""
    folder = tmp_path_factory.mktemp('wheel')
    source = folder / 'source'
    ignored = shutil.ignore_patterns('__pycache__', 'build', '*.egg-info')
    shutil.copytree(ROOT / 'src', source / 'src', ignore=ignored)
    for name in ('pyproject.toml', 'README.md', 'LICENSE'):
        shutil.copy(ROOT / name, source)
    command = [sys.executable, '-m', 'uv', 'build', '-q', '--no-build-isolation', '--offline']
    subprocess.run([*command, '-o', str(folder), str(source)], check=True)
    (path,) = folder.glob('*.whl')
    return ZipFile(path)


@pytest.fixture(scope='module')
def names(wheel: ZipFile) -> list[str]:
    return wheel.namelist()


def test_the_wheel_holds_the_packages_and_their_data(names: list[str]) -> None:
    tops = {name.partition('/')[0] for name in names if '.dist-info/' not in name}

    assert tops == set(PACKAGES)
    assert set(names) >= DATA
    assert all(f'{package}/py.typed' in names for package in PACKAGES)


def test_every_module_of_the_source_is_in_the_wheel(names: list[str]) -> None:
    for package in PACKAGES:
        base = ROOT / 'src' / package
        modules = {str(path.relative_to(base)) for path in base.glob(f'{package}/**/*.py')}
        assert modules <= set(names)


def test_the_wheel_offers_the_command_and_needs_what_running_needs(wheel: ZipFile) -> None:
    (info,) = {name.partition('/')[0] for name in wheel.namelist() if '.dist-info/' in name}
    metadata = Parser().parsestr(wheel.read(f'{info}/METADATA').decode())
    text = (ROOT / 'pyproject.toml').read_text()
    dependencies = re.search(r'^dependencies = \[(.*?)^\]', text, _LINES)

    entries = wheel.read(f'{info}/entry_points.txt').decode()
    learners = re.search(
        r"^\[project.entry-points.'goalreach.learners'\]\n(.*?)\n\n", text, _LINES
    )
    assert learners is not None
    assert sorted(filter(None, entries.splitlines())) == sorted(
        [
            '[console_scripts]',
            'goalreach = goalreach_bringup.cli:main',
            '[goalreach.learners]',
            *learners[1].replace("'", '').splitlines(),
        ]
    )
    assert f"version = '{metadata['Version']}'" in text
    needed = {x for x in metadata.get_all('Requires-Dist', ()) if 'extra ==' not in x}
    assert dependencies is not None
    assert needed == set(re.findall("'(.*?)'", dependencies[1]))
    assert {'dashboard', 'gym'} <= set(metadata.get_all('Provides-Extra', ()))
