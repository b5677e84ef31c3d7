from pathlib import Path

import pytest

from goalreach_evaluation.results_file import ResultsFile
from goalreach_msgs_py.errors import FileFormatError

KEY = ('noise', 'robot')
CASES = [{'noise': 'none', 'robot': 0}, {'noise': 'none', 'robot': 1}]


def open_file(path: Path | None) -> ResultsFile:
    return ResultsFile(path, key=KEY)


def test_finished_cases_are_kept_and_not_missing(tmp_path: Path) -> None:
    path = tmp_path / 'new' / 'study.jsonl'
    file = open_file(path)
    assert file.missing(CASES) == CASES
    file.add(CASES[1], {'error_in': (0.5, 1.0)})
    for results in (file, open_file(path)):
        assert results.missing(CASES) == CASES[:1]
        assert results.select(CASES) == [{'noise': 'none', 'robot': 1, 'error_in': [0.5, 1.0]}]
    assert path.read_text() == '{"noise": "none", "robot": 1, "error_in": [0.5, 1.0]}\n'


@pytest.mark.parametrize('end', ['', '\n'])
def test_an_incomplete_line_loses_its_own_case_alone(tmp_path: Path, end: str) -> None:
    path = tmp_path / 'study.jsonl'
    open_file(path).add(CASES[0], {'n': 1})
    with path.open('a') as stream:
        stream.write('{"noise": "none", "rob' + end)
    file = open_file(path)
    assert file.missing(CASES) == CASES[1:]
    file.add(CASES[1], {'n': 2})
    assert [one['n'] for one in open_file(path).results] == [1, 2]


def test_results_stay_in_memory_without_a_file() -> None:
    file = open_file(None)
    file.add(CASES[0], {'n': 1})
    assert file.results == [{**CASES[0], 'n': 1}]


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('# A document\n', 'line 1: is not a JSON object'),
        ('[1, 2]\n', 'line 1: is not a JSON object'),
        ('{"noise": "none", "robot": 0}\n{"noise": "none"}\n', 'line 2: robot is missing'),
        ('{"noise": "none", "robot": [0]}\n', r'line 1: robot = \[0\]'),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / 'study.jsonl'
    path.write_text(text)
    with pytest.raises(FileFormatError, match=reason):
        open_file(path)


def test_a_file_that_cannot_be_read_or_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match='cannot be read'):
        open_file(tmp_path)
    file = open_file(tmp_path / 'study.jsonl')
    (tmp_path / 'study.jsonl').mkdir()
    with pytest.raises(FileFormatError, match='cannot be written'):
        file.add(CASES[0], {})
