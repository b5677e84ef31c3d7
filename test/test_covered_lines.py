"""How the gate counts the lines that run."""

import json
from pathlib import Path

import pytest

covered_lines = pytest.importorskip('covered_lines')


@pytest.mark.parametrize(
    ('path', 'module'),
    [
        ('/w/src/goalreach_sim/goalreach_sim/ros/clocks.py', 'goalreach_sim/ros/clocks.py'),
        ('/w/lib/python3.11/site-packages/goalreach_sim/axis.py', 'goalreach_sim/axis.py'),
        ('/w/lib/python3.11/site-packages/numpy/core.py', None),
        ('/w/src/goalreach_sim/goalreach_sim/config/a.yaml', None),
        ('/w/test/goalreach_sim/test_axis.py', None),
    ],
)
def test_a_module_has_one_name_wherever_it_is_imported_from(path: str, module: str | None) -> None:
    assert covered_lines.module_of(Path(path)) == module


def test_lines_count_once_and_modules_that_nobody_imports_count(tmp_path: Path) -> None:
    package = tmp_path / 'src' / 'goalreach_a' / 'goalreach_a'
    package.mkdir(parents=True)
    (package / 'seen.py').write_text('a = 1\nif a > 1:\n    a = 2\n')
    (package / 'unseen.py').write_text('b = 1\n')
    ran = tmp_path / 'ran'
    ran.mkdir()
    for process, lines in (('1', [1]), ('2', [1, 2])):
        (ran / f'{process}.json').write_text(json.dumps({'goalreach_a/seen.py': lines}))
    assert covered_lines.percent(ran, tmp_path) == 50.0
