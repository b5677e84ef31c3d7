from collections.abc import Mapping
import functools
from pathlib import Path
from typing import Any

import pytest

from goalreach_lab.study import Study, find, per_case, run_study
from goalreach_msgs_py.errors import FileFormatError


def double(case: Mapping[str, Any], *, marks: str) -> dict[str, Any]:
    """Return twice the number; leave a mark of each case that is measured."""
    with Path(marks).open('a', encoding='utf-8') as stream:
        stream.write(f'{case["number"]} ')
    if case['number'] == 3 and Path(marks).read_text(encoding='utf-8').count('3') == 1:
        raise KeyboardInterrupt
    return {'twice': 2 * case['number']}


def study(tmp_path: Path, *numbers: int, seed: int = 0) -> Study:
    return Study(
        name='doubles',
        key=('number',),
        settings={'seed': seed},
        cases=[{'number': number} for number in numbers],
        measure=per_case(functools.partial(double, marks=str(tmp_path / 'marks'))),
        analyse=lambda results: sum(one['twice'] for one in results),
    )


def test_an_interrupted_study_resumes_without_repeating_finished_cases(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_study(study(tmp_path, 1, 2, 3), tmp_path)
    assert find(study(tmp_path, 1, 2, 3), tmp_path, measure=False) == 6
    found = run_study(study(tmp_path, 3, 1, 2), tmp_path)
    assert [one['number'] for one in found] == [3, 1, 2]
    assert (tmp_path / 'marks').read_text() == '1 2 3 3 '
    assert find(study(tmp_path, 1, 2), tmp_path) == 6


def test_nothing_measured_has_no_findings(tmp_path: Path) -> None:
    assert find(study(tmp_path, 1), tmp_path / 'none', measure=False) is None
    assert find(study(tmp_path, 1)) == 2


def test_results_of_other_settings_are_refused(tmp_path: Path) -> None:
    run_study(study(tmp_path, 1), tmp_path)
    with pytest.raises(FileFormatError, match='holds results of seed = 0, not 1'):
        run_study(study(tmp_path, 1, seed=1), tmp_path)


def test_processes_find_what_one_process_finds() -> None:
    cases = [{'number': number} for number in range(3)]
    one, two = (
        sorted(per_case(dict, jobs=jobs)(cases), key=lambda pair: int(pair[0]['number']))
        for jobs in (1, 2)
    )
    assert one == two == [(case, case) for case in cases]
