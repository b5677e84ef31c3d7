"""The learners suite: tables by hand, cases that are measured, and the document."""

from pathlib import Path

import numpy as np
import pytest

from goalreach_lab.learners.curves import (
    IMAGES,
    KEY,
    NO_IMAGES,
    curve_study,
    curve_table,
    groups,
    random_arena,
    rows,
    spread,
)
from goalreach_lab.learners.grids import GRIDS, grid_arena, grid_study
from goalreach_lab.learners.sitting import course, learned_after, sitting_table
from goalreach_lab.learners.suite import Options, execute
from goalreach_lab.study import run_study
from goalreach_lab.study_file import StudyFile

RUN = {'learned': True, 'paths': 5.0, 'bumps': 4.0, 'length_m': 10.4, 'time_s': 60.2, 'lost': 0}
NEVER = {**RUN, 'learned': False, 'paths': 0.0, 'lost': 2}
SITTING = {
    'number': 0,
    'paths': [
        {'outcome': 'bump', 'duration_s': 30.0, 'length_m': 1.0},
        {'outcome': 'bump', 'duration_s': 60.0, 'length_m': 1.0},
        {'outcome': 'goal', 'duration_s': 30.0, 'length_m': 1.0},
    ],
    'leads': [0, 13, 22],
}


def case(
    arena: str, number: int, learner: str = 'planner', drive: str = IMAGES
) -> dict[str, object]:
    return dict(zip(KEY, (learner, arena, drive, number), strict=True))


def test_a_run_that_never_learned_counts_as_endless() -> None:
    found = groups([{**case('random 1', 0), **RUN}, {**case('random 2', 1), **NEVER}])
    ((key, results),) = found.items()
    assert key == ('planner', 'random', IMAGES)
    assert len(results) == 2
    assert '| planner | random | images, nominal noise | 2 | 1 | 5 / never |' in curve_table(found)
    met = {row.name: row.met for row in rows(found)}
    assert met['planner, random: paths, median'] is True
    assert met['planner, random: paths, 95th percentile'] is False
    assert met['planner, random: runs that lost it'] is False


def test_spread_is_made_of_values() -> None:
    assert spread(np.array([1.0, 2.0, 3.0, np.inf])) == (2.0, np.inf)


def test_random_arenas_are_repeatable_and_differ() -> None:
    first, again, second = random_arena(3, 1), random_arena(3, 1), random_arena(3, 2)
    assert first == again
    assert first.width_m != second.width_m
    assert len({random_arena(0, n).regions.goal for n in range(1, 51)}) == 9


def test_cases_are_measured_and_repeat() -> None:
    study = curve_study(seeds=1, image_seeds=0, seed=2, jobs=1)
    planner = [
        next(one for one in study.cases if (one['learner'], one['drive']) == ('planner', drive))
        for drive in (NO_IMAGES, IMAGES)
    ]
    first, second = ([r for _, r in study.measure([one])] for one in planner)
    assert first[0]['learned']
    assert first[0]['time_s'] == 0.0
    assert second[0]['learned']
    assert second[0]['bumps'] <= 8
    assert [r for _, r in study.measure([planner[0]])] == first


@pytest.mark.parametrize('grid', list(GRIDS))
def test_a_grid_is_learned_and_driven(grid: str) -> None:
    columns, rows_, goal, _ = GRIDS[grid]
    assert grid_arena(*GRIDS[grid]).regions.shape == (columns, rows_)
    study = grid_study(starts=2, seed=1, jobs=1)
    (case_,) = (one for one in study.cases if one['grid'] == grid)
    ((_, result),) = study.measure([case_])
    assert result['learned'] == 22
    assert result['outcomes'] == ['goal', 'goal']
    assert grid_arena(*GRIDS[grid]).regions.goal == goal


def test_a_sitting_by_hand() -> None:
    assert course(SITTING) == [(0.5, 1, 0), (1.5, 2, 13), (2.0, 2, 22)]
    assert learned_after(SITTING) == 3
    assert '| 1 | 3 | 2 | 2.0 |' in sitting_table([SITTING])
    half = {**SITTING, 'leads': [0, 13, 21]}
    assert learned_after(half) is None
    assert '| 1 | never | - | - |' in sitting_table([half])


def test_the_document_holds_what_was_measured_so_far(tmp_path: Path) -> None:
    study = curve_study(seeds=1, image_seeds=0, seed=7, jobs=1)
    file = StudyFile(tmp_path / 'curves.jsonl', key=study.key, settings=study.settings)
    for learner in ('planner', 'paper'):
        file.add(case('paper', 0, learner, NO_IMAGES), RUN)
    file.add(case('paper', 0), RUN)
    options = Options(seed=7, results=tmp_path, as_it_is=True, out=tmp_path / 'LEARNERS.md')
    found = execute(options)
    assert all(row.met for row in found)
    text = (tmp_path / 'LEARNERS.md').read_text()
    assert (
        f'| planner | paper | {IMAGES} | 1 | 1 | 5 / 5 | 4 / 4 | 10 / 10 | 60 / 60 | 0 |' in text
    )
    assert '## A session in real time' not in text
    assert (tmp_path / 'figures' / 'learners_profiles.png').exists()


@pytest.mark.graph
def test_a_sitting_over_the_graph(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from goalreach_lab.learners import sitting

    monkeypatch.setattr(sitting, 'PATHS', 2)
    (result,) = run_study(sitting.sitting_study(sittings=1, seed=1), tmp_path)
    assert len(result['paths']) == 2
    assert result['paths'][0]['outcome'] == 'bump'
    assert result['leads'][0] == 0
