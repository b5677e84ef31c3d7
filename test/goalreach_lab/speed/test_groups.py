"""Every row of the bench, with the smallest budget."""

import json
from pathlib import Path

import pytest

from goalreach_lab.cli import main
from goalreach_lab.speed.measurement import Budget
from goalreach_lab.speed.suite import GROUPS, rows_of
from graphs import fresh_domain

BUDGET = Budget(seed=1, scale=0.001)
ALONE = ('driving', 'localization', 'recording', 'evaluation')
GRAPHS = ('lockstep', 'real-time', 'start', 'readers')


@pytest.fixture(autouse=True)
def _domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', str(fresh_domain()))


def test_all_groups_are_tested() -> None:
    assert {*ALONE, *GRAPHS, 'learning'} == set(GROUPS)


@pytest.mark.parametrize('name', ALONE)
def test_rows_without_a_graph(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('goalreach_lab.speed.driving._PATHS', 1)
    monkeypatch.setattr('goalreach_lab.speed.driving._IRSIM_DRIVES', 2)
    rows = rows_of(name, BUDGET)
    assert rows
    assert all(row.ours > 0.0 for row in rows if 'growth' not in row.name)
    if name == 'localization':
        assert {row.reference_name for row in rows if row.reference} >= {
            'SimpleBlobDetector + solveP3P'
        }


@pytest.mark.graph
@pytest.mark.parametrize('name', GRAPHS)
def test_rows_of_a_graph(name: str) -> None:
    rows = rows_of(name, BUDGET)
    assert rows
    alone = [row.name for row in rows if row.reference is None]
    assert len(alone) == (2 if name == 'lockstep' else 0)
    if name == 'lockstep':
        assert all(row.reference is not None for row in rows[:2])
        assert all(row.ours > 0.0 for row in rows)


def test_bench_without_a_suite_writes_rows_and_document(tmp_path: Path) -> None:
    table, document = tmp_path / 'rows.json', tmp_path / 'PERFORMANCE.md'
    options = ['--seed', '2', '--scale', '0.001', '--only', 'recording']
    status = main([*options, '--json', str(table), '--out', str(document)])
    assert status in (0, 1)
    written = json.loads(table.read_text())
    (row,) = written['rows']
    assert row['reference_name'] == 'raw writer of rosbags'
    assert row['ratio'] == row['ours'] / row['reference']
    assert written['seed'] == 2
    assert '## Recording' in document.read_text()


def test_no_scale_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['--scale', '0', '--only', 'recording']) == 2
    assert '--scale' in capsys.readouterr().err
