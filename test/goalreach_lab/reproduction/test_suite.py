"""The document from a few kept results; no path is driven."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from goalreach_lab.reproduction.driving_study import (
    arena_conditions,
    driving_study,
    image_learning_study,
    mode_conditions,
    policy_conditions,
)
from goalreach_lab.reproduction.suite import Options, execute
from goalreach_lab.study import Study, find
from goalreach_lab.study_file import StudyFile
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError

PATH = {
    'outcome': 'goal',
    'duration_s': 10.0,
    'length_m': 3.0,
    'turning_deg': 90.0,
    'step_deg': 2.0,
    'shortest_m': 2.0,
    'error_rms_m': 0.0254,
}


def options(folder: Path) -> Options:
    return Options(
        results=folder,
        out=folder / 'REPRODUCTION.md',
        fuzzy=2,
        harsh=2,
        others=2,
        others_harsh=2,
        arenas=2,
        policy_paths=2,
        seeds=5,
        variation_seeds=2,
        blend_starts=2,
        image_policies=1,
        image_trials=1,
    )


def keep(study: Study, folder: Path, result: dict[str, Any]) -> None:
    """Keep a made-up result of every case of a study."""
    file = StudyFile(folder / f'{study.name}.jsonl', key=study.key, settings=study.settings)
    for case in study.cases:
        file.add(case, result)


def test_the_document_is_written_from_kept_results(tmp_path: Path) -> None:
    images = image_learning_study(count=1, trials=1, seed=0, jobs=1)
    untrained = Policy.unlearned(Arena().regions)
    keep(images, tmp_path, {'q': untrained.q.tolist(), 'visits': untrained.visits.tolist()})
    modes = mode_conditions(0, fuzzy=2, harsh=2, others=2, others_harsh=2)
    for name, conditions in (
        ('driving', [*modes.values(), *arena_conditions(0, 2).values()]),
        ('policies-1', policy_conditions(find(images, tmp_path), 2)),
    ):
        study = driving_study(conditions, name=name, seed=0, jobs=1)
        keep(study, tmp_path, {'driven': [PATH] * 2})
    rows = {row.name: row for row in execute(options(tmp_path))}
    assert rows['fuzzy, nominal noise, random starts: goal reached'].met is True
    text = (tmp_path / 'REPRODUCTION.md').read_text()
    for heading in ('## Equation (3)', '## Other arenas', '## Free parameters'):
        assert heading in text
    assert '| narrow | 2 | 100.00 %' in text
    assert '| goal reached | 100.00 % [34.24, 100.00] | 100.00 % [34.24, 100.00] |' in text
    assert '$' not in text


def test_nothing_measured_leaves_its_sections_out(tmp_path: Path) -> None:
    assert execute(replace(options(tmp_path), as_it_is=True)) == []
    text = (tmp_path / 'REPRODUCTION.md').read_text()
    assert [line for line in text.splitlines() if line.startswith('## ')] == ['## Free parameters']


def test_refuses_no_paths() -> None:
    with pytest.raises(ConfigurationError, match='--fuzzy = 0'):
        Options(fuzzy=0)
