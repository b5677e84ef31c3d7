"""colcon's part of the gate: the five packages in a ROS 2 workspace of their own.

Everything is built into a scratch folder; the repository stays as it is.
"""

from dataclasses import dataclass
import os
from pathlib import Path
import shutil
import subprocess
import sys
from xml.etree import ElementTree as ET

PACKAGE_TYPE = '(ros.ament_python)'


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

    def list_packages(self) -> tuple[bool, str]:
        """Check that colcon takes each folder under ``src/`` for an ament_python package."""
        printed = self._output('list')
        found = {line.split()[0]: line.split()[-1] for line in printed.splitlines()}
        expected = dict.fromkeys(self._packages(), PACKAGE_TYPE)
        ok = found == expected
        return ok, f'{len(found)} packages' if ok else f'colcon list says {found}'

    def build(self) -> tuple[bool, str]:
        """Build and install the packages, and check that each node can be started."""
        if not self._run('build', *self._bases()):
            return False, ''
        executables = self._executables()
        lacking = [
            f'{package}/{name}'
            for package, name in executables
            if not (self.scratch / 'install' / package / 'lib' / package / name).is_file()
        ]
        note = f'not installed: {lacking}' if lacking else f'{len(executables)} executables'
        return bool(executables) and not lacking, note

    def test(self) -> tuple[bool, str]:
        """Run the packages' tests and check that there were some in each."""
        results = ['--test-result-base', str(self.scratch / 'results')]
        ok = self._run('test', '--return-code-on-test-failure', *self._bases(), *results)
        counts = {name: self._count(name) for name in self._packages()}
        for line in self._failures():
            print(line)
        note = ', '.join(f'{name} {count}' for name, count in counts.items())
        return ok and all(counts.values()), note

    def _packages(self) -> list[str]:
        return [path.parent.name for path in sorted(self.root.glob('src/*/package.xml'))]

    def _executables(self) -> list[tuple[str, str]]:
        """Return package and name of each executable that a built package declares."""
        found = []
        for package in self._packages():
            for path in (self.scratch / 'install' / package).rglob('entry_points.txt'):
                names = [
                    line.split(' = ')[0] for line in path.read_text().split('\n') if '=' in line
                ]
                found += [(package, name) for name in names]
        return found

    def _count(self, package: str) -> int:
        files = (self.scratch / 'results' / package).glob('**/*.xml')
        suites = [suite for path in files for suite in ET.parse(path).iter('testsuite')]  # noqa: S314
        return sum(int(suite.get('tests', '0')) for suite in suites)

    def _failures(self) -> list[str]:
        """Return a line for each failed test: its name and the end of what it said."""
        lines = []
        for path in sorted((self.scratch / 'results').glob('**/*.xml')):
            for case in ET.parse(path).iter('testcase'):  # noqa: S314 - pytest wrote it
                for kind in ('failure', 'error'):
                    if (found := case.find(kind)) is not None:
                        said = (found.get('message') or '').strip().split('\n')[0]
                        lines.append(f'FAILED {case.get("classname")}::{case.get("name")}: {said}')
        return lines

    def _bases(self) -> list[str]:
        folders = [str(self.scratch / name) for name in ('build', 'install')]
        return ['--build-base', folders[0], '--install-base', folders[1]]

    def _command(self, words: tuple[str, ...]) -> list[str]:
        return [self.colcon, '--log-base', str(self.scratch / 'log'), *words]

    def _run(self, *words: str) -> bool:
        command = self._command(words)
        environment = {
            **os.environ,
            'HYPOTHESIS_STORAGE_DIRECTORY': str(self.scratch / 'hypothesis'),
        }
        done = subprocess.run(command, cwd=self.root, check=False, env=environment)
        return done.returncode == 0

    def _output(self, *words: str) -> str:
        command = self._command(words)
        done = subprocess.run(
            command, cwd=self.root, check=False, stdout=subprocess.PIPE, text=True
        )
        print(done.stdout, end='')
        return done.stdout


def find() -> str | None:
    """Return the path of colcon, of this environment if it is there, or None."""
    beside = Path(sys.executable).with_name('colcon')
    return str(beside) if beside.is_file() else shutil.which('colcon')
