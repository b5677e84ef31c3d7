"""What `pip install` brings: the packages with their data, nothing of the laboratory."""

from pathlib import Path
import shutil
import subprocess
import sys
from zipfile import ZipFile

import pytest

from architecture import PACKAGES

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
DATA = {
    'goalreach_bringup/config/goalreach.rviz',
    'goalreach_dashboard/static/live.js',
    'goalreach_msgs_py/config/arenas/paper.yaml',
    'goalreach_msgs_py/config/fastdds.xml',
}


@pytest.fixture(scope='module')
def names(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp('wheel')
    source = folder / 'source'
    ignored = shutil.ignore_patterns('__pycache__', 'build', '*.egg-info')
    shutil.copytree(ROOT / 'src', source / 'src', ignore=ignored)
    for name in ('pyproject.toml', 'README.md', 'LICENSE'):
        shutil.copy(ROOT / name, source)
    command = [sys.executable, '-m', 'pip', 'wheel', '-q', '--no-deps', '--no-build-isolation']
    subprocess.run([*command, '-w', str(folder), str(source)], check=True)
    (wheel,) = folder.glob('*.whl')
    return ZipFile(wheel).namelist()


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
