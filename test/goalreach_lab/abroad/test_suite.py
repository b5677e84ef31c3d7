"""The table of the abroad suite, by hand."""

from pathlib import Path

import pytest

from goalreach_lab.abroad.suite import Options, cells, execute
from goalreach_lab.study_file import StudyFile
from goalreach_msgs_py.errors import ConfigurationError

GOAL = {'outcome': 'goal', 'duration_s': 8.0, 'errors': [[0.0254, 2.0], [0.0254, 10.0]]}
SILENT = {'outcome': 'silent', 'errors': []}


def test_the_cells_of_a_case_by_hand() -> None:
    slow = {**GOAL, 'duration_s': 10.0}
    assert cells([GOAL, slow, SILENT]) == ['2 / 0 / 0 / 0 / 1', '1.00', '6', '50', '9.0']


def test_a_case_without_a_pose_has_only_outcomes() -> None:
    assert cells([SILENT]) == ['0 / 0 / 0 / 0 / 1', '-', '-', '-', '-']
    lost = {**GOAL, 'outcome': 'timeout'}
    assert cells([lost]) == ['0 / 0 / 0 / 1 / 0', '1.00', '6', '50', '-']


def test_the_document_holds_what_was_driven_so_far(tmp_path: Path) -> None:
    path, key = tmp_path / 'abroad.jsonl', ('case', 'world', 'starts', 'number')
    file = StudyFile(path, key=key, settings={'seed': 7})
    file.add(
        {'case': 'soft', 'world': 0, 'starts': 'border', 'number': 8},
        {**GOAL, 'outcome': 'false-goal', 'trace': [[1.0, 2.0], [1.0, 1.0]]},
    )
    file.add({'case': 'soft', 'world': 1, 'starts': 'border', 'number': 17}, SILENT)
    out = tmp_path / 'ABROAD.md'
    options = Options(seed=7, results=tmp_path, as_it_is=True, out=out)
    wrong, short = execute(options)
    assert (wrong.ours, wrong.n, wrong.met) == (1, 2, False)
    assert (short.ours, short.met) == (1, False)
    assert '| soft | --tyres soft | 0 / 1 / 0 / 0 / 1 | 1.00 |' in out.read_text()
    assert (tmp_path / 'figures' / 'abroad_paths.png').exists()


def test_an_unknown_case_is_refused_by_name() -> None:
    with pytest.raises(ConfigurationError, match="--case = 'dusk': must be one of dark, "):
        execute(Options(case=('dusk',)))
