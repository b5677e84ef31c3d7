import json
from pathlib import Path
from typing import Any

import pytest

from goalreach_evaluation.summary_file import read_recorded_run
from goalreach_msgs_py.errors import FileFormatError


def write(folder: Path, document: object) -> Path:
    file = folder / 'e.json'
    file.write_text(json.dumps(document))
    return file


def test_reads_the_traced_paths(tmp_path: Path) -> None:
    paths = [
        {'outcome': 'timeout', 'trace': [[1, 2], [3, 4]]},
        {'outcome': 'goal'},
    ]
    found = read_recorded_run(write(tmp_path, {'mode': 'crisp', 'paths': paths}))
    assert found.mode == 'crisp'
    assert [outcome for _, outcome in found.paths] == ['timeout']
    assert found.paths[0][0].tolist() == [[1.0, 2.0], [3.0, 4.0]]


@pytest.mark.parametrize(
    ('document', 'line'),
    [
        ([], 'paths is missing'),
        ({'paths': 3}, 'paths is missing'),
        ({'paths': [7]}, r'paths\[0\] = 7: must be an object'),
        ({'paths': [{'outcome': 'won'}]}, r"paths\[0\].outcome = 'won': must be one of goal"),
        ({'paths': [{'outcome': 'goal', 'trace': [[1, 2, 3]]}]}, r'paths\[0\].trace: must be'),
        ({'paths': [{'outcome': 'goal', 'trace': [[1, 'x']]}]}, r'paths\[0\].trace: must be'),
        ({'paths': [{'outcome': 'goal', 'trace': [[1, 2], [3]]}]}, r'paths\[0\].trace: must'),
        ({'paths': [{'outcome': 'goal'}]}, 'paths: none has a trace to draw'),
    ],
)
def test_refuses_a_defect(document: Any, line: str, tmp_path: Path) -> None:  # noqa: ANN401 - JSON
    with pytest.raises(FileFormatError, match=r'e\.json: ' + line):
        read_recorded_run(write(tmp_path, document))


def test_refuses_what_is_not_there_or_no_json(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match='No such file'):
        read_recorded_run(tmp_path / 'none.json')
    (tmp_path / 'bad.json').write_text('{')
    with pytest.raises(FileFormatError, match='is not JSON'):
        read_recorded_run(tmp_path / 'bad.json')
