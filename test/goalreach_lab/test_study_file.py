from pathlib import Path

import pytest

from goalreach_evaluation.results_file import ResultsFile
from goalreach_lab.study_file import StudyFile, code_version
from goalreach_msgs_py.errors import FileFormatError

KEY = ('noise', 'robot')
VERSION = code_version('src', 'lab', 'examples')
CASES = [{'noise': 'none', 'robot': 0}, {'noise': 'none', 'robot': 1}]


def open_file(path: Path, **settings: object) -> StudyFile:
    return StudyFile(path, key=KEY, settings=settings)


def test_the_first_line_holds_the_settings(tmp_path: Path) -> None:
    path = tmp_path / 'new' / 'study.jsonl'
    for case in CASES:
        open_file(path, seed=1, sizes=(2, 3)).add(case, {'n': 1})
    assert path.read_text().splitlines() == [
        '{"settings": {"seed": 1, "sizes": [2, 3]}}',
        f'{{"noise": "none", "robot": 0, "n": 1, "made_by": "{VERSION}"}}',
        f'{{"noise": "none", "robot": 1, "n": 1, "made_by": "{VERSION}"}}',
    ]
    assert open_file(path, seed=1, sizes=(2, 3)).results == [{**case, 'n': 1} for case in CASES]
    assert open_file(path, seed=1, sizes=(2, 3)).missing(CASES) == []


def test_results_of_other_code_and_of_other_seeds_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'study.jsonl'
    before = '{"settings": {"speed": 2}}\n{"noise": "none", "robot": 0, "n": 1}\n'
    path.write_text(before)  # as it was before versions were kept
    first = StudyFile(path, key=KEY, settings={'speed': 2}, seed=3)
    first.tell_others()
    assert (
        capsys.readouterr().err
        == f'{path}: holds results made 1 by unknown; now {VERSION}, seed 3\n'
    )
    first.add(CASES[1], {'n': 2})
    second = StudyFile(path, key=KEY, settings={'speed': 2}, seed=4)
    assert [one['n'] for one in second.results] == [1, 2]
    second.tell_others()
    assert f'1 by {VERSION}, seed 3; now {VERSION}, seed 4' in capsys.readouterr().err


def test_an_incomplete_line_loses_its_own_case_alone(tmp_path: Path) -> None:
    path = tmp_path / 'study.jsonl'
    open_file(path, seed=1).add(CASES[0], {'n': 1})
    with path.open('a') as stream:
        stream.write('{"noise": "none", "rob')
    open_file(path, seed=1).add(CASES[1], {'n': 2})
    assert [one['n'] for one in open_file(path, seed=1).results] == [1, 2]


def test_results_without_settings_are_refused(tmp_path: Path) -> None:
    path = tmp_path / 'sweep.jsonl'
    ResultsFile(path, key=KEY).add(CASES[0], {'n': 1})
    with pytest.raises(FileFormatError, match=r"settings = None: must be \{'seed': 1\}"):
        open_file(path, seed=1)


@pytest.mark.parametrize(
    ('settings', 'reason'),
    [
        ({'seed': 2}, 'holds results of seed = 1, not 2'),
        ({'seed': 1, 'images': 9}, 'holds results of images = None, not 9'),
        ({}, 'holds results of seed = 1, not None'),
    ],
)
def test_results_of_other_settings_are_refused(
    tmp_path: Path, settings: dict[str, object], reason: str
) -> None:
    path = tmp_path / 'study.jsonl'
    open_file(path, seed=1).add(CASES[0], {'n': 1})
    before = path.read_bytes()
    with pytest.raises(FileFormatError, match=reason):
        open_file(path, **settings)
    assert path.read_bytes() == before
