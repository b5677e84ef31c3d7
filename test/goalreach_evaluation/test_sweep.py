"""Sweeps on processes and on a Dask cluster of two workers, and workers that die."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager
import functools
import json
from pathlib import Path
from typing import Any

import pytest

from dying_workers import die, die_once
from goalreach_bringup.cli import main
from goalreach_evaluation.evaluation import processes
from goalreach_evaluation.sweep import SweepCase, dask_workers, drive_case, run_cases
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NoiseModel

Opener = Callable[[], AbstractContextManager[Executor]]
TWO_PROCESSES: Opener = functools.partial(processes, 2)


def case(seed: int, noise_name: str = 'nominal') -> SweepCase:
    return SweepCase(
        arena_name='paper',
        arena=Arena(),
        noise_name=noise_name,
        noise=NoiseModel(),
        mode='fuzzy',
        drives=1,
        seed=seed,
    )


def test_without_dask_its_option_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('importlib.util.find_spec', lambda _: None)
    with pytest.raises(GoalreachError, match=r'^--engine dask needs distributed'), dask_workers(1):
        pass


def two_dask_workers() -> AbstractContextManager[Executor]:
    pytest.importorskip('distributed')
    return dask_workers(2)


@contextmanager
def counted(opened: list[int], open_executor: Opener) -> Iterator[Executor]:
    opened.append(1)
    with open_executor() as executor:
        yield executor


def test_a_case_depends_on_its_seed_alone() -> None:
    first = drive_case(case(3))
    assert first == drive_case(case(3))
    assert first['outcomes'] == {'goal': 1}
    assert first['frames'] > 0
    assert drive_case(case(4))['sim_time_s'] != first['sim_time_s']


@pytest.mark.parametrize('open_executor', [TWO_PROCESSES, two_dask_workers])
def test_both_engines_find_what_one_process_finds(open_executor: Opener) -> None:
    cases = [case(seed) for seed in range(3)]
    found = [result for _, result in run_cases(cases, drive_case, open_executor)]
    found.sort(key=lambda result: int(result['seed']))
    assert found == [drive_case(one) for one in cases]


@pytest.mark.parametrize('open_executor', [TWO_PROCESSES, two_dask_workers])
def test_a_worker_that_dies_loses_no_result(tmp_path: Path, open_executor: Opener) -> None:
    drive = functools.partial(die_once, str(tmp_path / 'died'))
    kept = list(run_cases([case(seed) for seed in range(4)], drive, open_executor))
    assert sorted(result['seed'] for _, result in kept) == [0, 1, 2, 3]
    assert all(one.seed == result['seed'] for one, result in kept)
    assert (tmp_path / 'died').exists()


def test_where_workers_keep_dying_what_is_finished_is_kept() -> None:
    kept: list[dict[str, Any]] = []
    opened: list[int] = []
    one_process = functools.partial(counted, opened, functools.partial(processes, 1))
    measured = run_cases([case(seed) for seed in (0, 1, 2)], die, one_process)
    with pytest.raises(GoalreachError, match=r'workers keep dying: [12] of 3 cases are not done'):
        kept.extend(result for _, result in measured)
    assert len(opened) == 3
    assert 0 in [result['seed'] for result in kept]


def test_the_command_goes_on_where_it_ended(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'sweep.jsonl'
    path.write_text(json.dumps({**case(0).key, 'outcomes': {'goal': 1}}) + '\n')
    options = ['--drives', '1', '--seeds', '1', '--noise', 'nominal', 'none']
    assert main(['sweep', '--results', str(path), *options]) == 0
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line['noise'] for line in lines] == ['nominal', 'none']
    assert '1 of 2 cases are done' in capsys.readouterr().out


def test_bad_options_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(tmp_path / 'sweep.jsonl')
    assert main(['sweep', '--results', path, '--seeds', '0']) == 2
    assert main(['sweep', '--results', path, '--noise', 'loud']) == 2
    error = capsys.readouterr().err
    assert '--seeds = 0' in error
    assert 'loud: is no preset' in error


@pytest.mark.parametrize('address', ['nonsense', 'nonsense://127.0.0.1:1'])
def test_what_is_no_address_of_a_scheduler_is_named(address: str) -> None:
    pytest.importorskip('distributed')
    said = pytest.raises(GoalreachError, match=f'^{address}: does not answer: ')
    with said, dask_workers(1, address):
        pass
