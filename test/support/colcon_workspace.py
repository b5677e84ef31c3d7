"""colcon's part of the gate: the packages in a ROS 2 workspace of their own.

Everything is built into a scratch folder; the repository stays as it is.
"""

from dataclasses import dataclass
import os
from pathlib import Path
import shutil
import subprocess
import sys
from xml.etree import ElementTree as ET

import covered_lines

PACKAGE_TYPE = '(ros.ament_python)'
LEAST_COVERAGE = 75.0  # % of the lines of src, by the packages' own tests, without graphs
_BRINGUP = 'goalreach_bringup/share/goalreach_bringup'
SHARED = (
    f'{_BRINGUP}/launch/goalreach.launch.py',
    f'{_BRINGUP}/launch/page.launch.py',
    f'{_BRINGUP}/params/lockstep.yaml',
    f'{_BRINGUP}/rviz/goalreach.rviz',
    f'{_BRINGUP}/urdf/nomad200.urdf',
    'goalreach_msgs_py/share/goalreach_msgs_py/arenas/paper.yaml',
    'goalreach_learning/share/goalreach_learning/policies/paper.json',
)
"""Files of share that must be installed."""


@dataclass(frozen=True, kw_only=True)
class Workspace:
    """The repository as a colcon workspace.

    Attributes:
        colcon: Path of the program.
        root: Root of the repository.
        scratch: Folder for all that is built.
    """

    colcon: str
    root: Path
    scratch: Path

    @classmethod
    def find(cls, root: Path, scratch: Path) -> 'Workspace | None':
        """Return the workspace, or None where colcon is not installed."""
        own = Path(sys.executable).with_name('colcon')
        colcon = str(own) if own.is_file() else shutil.which('colcon')
        return cls(colcon=colcon, root=root, scratch=scratch) if colcon else None

    def list_packages(self) -> tuple[bool, str]:
        """Check that colcon takes each folder under `src/` for an ament_python package."""
        printed = self._run('list', capture=True).stdout
        print(printed, end='')
        found = {line.split()[0]: line.split()[-1] for line in printed.splitlines()}
        ok = found == dict.fromkeys(self._packages(), PACKAGE_TYPE)
        return ok, f'{len(found)} packages' if ok else f'colcon list says {found}'

    def build(self) -> tuple[bool, str]:
        """Build and install the packages, and check that each executable is there."""
        if self._run('build', *self._bases()).returncode:
            return False, ''
        install = self.scratch / 'install'
        declared = [
            (package, line.split(' = ')[0])
            for package in self._packages()
            for path in (install / package).rglob('entry_points.txt')
            for line in path.read_text().split('\n')
            if '=' in line
        ]
        lacking = [
            f'{package}/{name}'
            for package, name in declared
            if not (install / package / 'lib' / package / name).is_file()
        ]
        lacking += [path for path in SHARED if not (install / path).is_file()]
        note = f'not installed: {lacking}' if lacking else f'{len(declared)} executables'
        return bool(declared) and not lacking, note

    def test(self) -> tuple[bool, str]:
        """Run the packages' tests and check that there were some in each."""
        results = ['--test-result-base', str(self.scratch / 'results')]
        ok = not self._run(
            'test', '--return-code-on-test-failure', *self._bases(), *results
        ).returncode
        if not ok:
            self._run('test-result', *results, '--verbose')
        counts = {name: self._count(name) for name in self._packages()}
        note = ', '.join(f'{name} {count}' for name, count in counts.items())
        return ok and all(counts.values()), note

    def measure_coverage(self) -> tuple[bool, str]:
        """Check the share of the lines of src that ran in `test`."""
        found = covered_lines.percent(self._lines, self.root)
        return found >= LEAST_COVERAGE, f'{found:.0f} % of the lines of src'

    @property
    def _lines(self) -> Path:
        return self.scratch / 'lines'

    def _packages(self) -> list[str]:
        return [path.parent.name for path in sorted(self.root.glob('src/*/package.xml'))]

    def _count(self, package: str) -> int:
        files = (self.scratch / 'results' / package).glob('**/*.xml')
        suites = [suite for path in files for suite in ET.parse(path).iter('testsuite')]  # noqa: S314
        return sum(int(suite.get('tests', '0')) for suite in suites)

    def _bases(self) -> list[str]:
        folders = [str(self.scratch / name) for name in ('build', 'install')]
        return ['--build-base', folders[0], '--install-base', folders[1]]

    def _run(self, *words: str, capture: bool = False) -> 'subprocess.CompletedProcess[str]':
        return subprocess.run(
            [self.colcon, '--log-base', str(self.scratch / 'log'), *words],
            cwd=self.root,
            check=False,
            text=True,
            stdout=subprocess.PIPE if capture else None,
            env={
                **os.environ,
                'HYPOTHESIS_STORAGE_DIRECTORY': str(self.scratch / 'hypothesis'),
                covered_lines.VARIABLE: str(self._lines),
                'PYTEST_PLUGINS': covered_lines.__name__,  # colcon has PYTEST_ADDOPTS for itself
                'PYTHONPATH': os.pathsep.join(
                    filter(None, (str(Path(__file__).parent), os.environ.get('PYTHONPATH')))
                ),
            },
        )
