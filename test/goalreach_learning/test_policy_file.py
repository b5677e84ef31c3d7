from collections.abc import Callable
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.regions import RegionMap

Change = Callable[[dict[str, Any]], object]


def test_a_written_policy_is_read_back(tmp_path: Path, learned: Policy) -> None:
    file = tmp_path / 'policy.json'
    write_policy(file, learned)
    found = read_policy(file)
    assert np.array_equal(found.q, learned.q)
    assert np.array_equal(found.visits, learned.visits)
    assert found.regions == learned.regions
    assert found.learning == learned.learning
    assert found.actions == learned.actions


def test_file_is_as_documented(tmp_path: Path, learned: Policy) -> None:
    write_policy(tmp_path / 'p.json', learned)
    document = json.loads((tmp_path / 'p.json').read_text())
    assert (document['format'], document['version']) == ('goalreach-policy', 1)
    assert np.shape(document['q']) == np.shape(document['visits']) == (3, 3, 8)
    assert document['actions_rad'] == pytest.approx([k * np.pi / 4 for k in range(8)])
    assert len(document['regions']['x_knots_m']) == 6
    assert document['learning']['alpha'] == 0.3


def test_a_name_wins_over_a_file_of_that_name(
    tmp_path: Path, learned: Policy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shipped = read_policy('paper')
    write_policy('paper', learned)
    assert np.array_equal(read_policy('paper').q, shipped.q)
    for file in ('./paper', Path('paper')):
        assert np.array_equal(read_policy(file).q, learned.q)
    assert not np.array_equal(shipped.q, learned.q)


def test_another_goal_survives(tmp_path: Path) -> None:
    policy = Policy.unlearned(RegionMap(goal=(2, 2)))
    write_policy(tmp_path / 'p.json', policy)
    assert read_policy(tmp_path / 'p.json').regions.goal == (2, 2)


DEFECTS: dict[str, tuple[Change, str]] = {
    'format': (lambda d: d.update(format='x'), "format = 'x'"),
    'version': (lambda d: d.update(version=2), 'version = 2'),
    'version true': (lambda d: d.update(version=True), 'version = True'),
    'no q': (lambda d: d.pop('q'), 'q is missing'),
    'q short': (lambda d: d['q'][1].pop(), r'q\[1\] = \[\[.*: must be a list of 3 lists'),
    'q nan': (lambda d: d['q'][1][2].__setitem__(3, float('nan')), r'q\[1\]\[2\]\[3\] = nan'),
    'q text': (lambda d: d['q'][0][0].__setitem__(7, '1'), r"q\[0\]\[0\]\[7\] = '1'"),
    'q huge': (lambda d: d['q'][0][0].__setitem__(7, 10**400), r'q\[0\]\[0\]\[7\] = 1000'),
    'visits': (lambda d: d['visits'][0][0].__setitem__(0, -3), 'visits = -3'),
    'visits half': (lambda d: d['visits'][0][0].__setitem__(0, 0.5), 'visits = 0.5'),
    'visits huge': (lambda d: d['visits'][0][0].__setitem__(0, 2**53 + 2), 'visits = 90071992547'),
    'actions': (lambda d: d['actions_rad'].reverse(), r'actions_rad = .*: must be k \* pi / 4'),
    'an action off': (lambda d: d['actions_rad'].__setitem__(3, 2.3562), 'actions_rad = '),
    'actions short': (
        lambda d: d['actions_rad'].pop(),
        r'actions_rad = .*: must be a list of 8 n',
    ),
    'regions': (lambda d: d.update(regions=5), 'regions = 5'),
    'knots': (lambda d: d['regions']['x_knots_m'].reverse(), 'regions.x_knots_m = '),
    'no knots': (
        lambda d: d['regions'].update(y_knots_m=3),
        'regions.y_knots_m = 3: must be a list of numbers',
    ),
    'goal': (lambda d: d['regions'].update(goal=[1, 5]), r'regions.goal = \(1, 5\)'),
    'goal half': (lambda d: d['regions'].update(goal=[1, 1.5]), r'regions.goal = \[1, 1.5\]'),
    'forbidden': (lambda d: d['regions'].update(forbidden=3), 'regions.forbidden = 3'),
    'learner': (lambda d: d.update(learner={'name': 3}), 'learner.name = 3'),
    'learning': (lambda d: d.pop('learning'), 'learning is missing'),
    'gamma': (lambda d: d['learning'].update(gamma='x'), "learning.gamma = 'x'"),
    'gamma one': (lambda d: d['learning'].update(gamma=1), 'learning.gamma = 1'),
    'gamma below': (lambda d: d['learning'].update(gamma=-0.1), 'learning.gamma = -0.1'),
    'alpha': (lambda d: d['learning'].update(alpha=float('inf')), 'learning.alpha = inf'),
}


@pytest.mark.parametrize('name', DEFECTS)
def test_refuses_a_defect_by_file_field_and_value(
    name: str, tmp_path: Path, learned: Policy
) -> None:
    change, line = DEFECTS[name]
    file = tmp_path / 'bad.json'
    write_policy(file, learned)
    document = json.loads(file.read_text())
    change(document)
    file.write_text(json.dumps(document))
    with pytest.raises(FileFormatError, match=r'bad\.json: ' + line):
        read_policy(file)


@pytest.mark.parametrize('content', [b'', b'{', b'[]', b'\xff\xfe', b'[' * 10**5])
def test_refuses_files_of_other_formats(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / 'bad.json'
    file.write_bytes(content)
    with pytest.raises(FileFormatError, match=r'bad\.json'):
        read_policy(file)


def test_refuses_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match='No such file'):
        read_policy(tmp_path / 'none.json')
