"""A learner of one's own learns in one process and over the graph."""

from pathlib import Path
import subprocess
import sys

import pytest

from goalreach_learning.policy_file import read_policy
import graphs

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / 'examples' / 'own_learner.py'
NAME = 'own_learner:CuriousLearner'


def test_the_documents_show_the_example() -> None:
    page = (ROOT / 'docs' / 'how-to' / 'learner.md').read_text()
    assert EXAMPLE.read_text().partition('RATE')[2] in page


def test_the_example_learns_in_one_process(tmp_path: Path) -> None:
    (tmp_path / 'own_learner.py').write_text(EXAMPLE.read_text())
    train = [sys.executable, str(ROOT / 'scripts' / 'train.py'), '--learner', NAME]
    done = subprocess.run(
        [*train, '--out', 'p.json'], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert 'the best actions lead to the goal from 22 of 22 starts' in done.stdout
    assert read_policy(tmp_path / 'p.json').learner == {'name': NAME, 'state': {}}


@pytest.mark.graph
def test_the_example_drives_the_graph_and_continues(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(EXAMPLE.parent)
    path = tmp_path / 'policy.json'
    arguments = ['run', '--learn', '--policy', str(path), '--clock', 'lockstep', '--paths', '2']
    for options in (['--learner', NAME], []):
        with graphs.goalreach(
            [*arguments, *options], domain=graphs.fresh_domain(), home=tmp_path
        ) as run:
            output, _ = run.communicate(timeout=100.0)
        assert run.returncode in (0, 1), output
    policy = read_policy(path)
    assert policy.learning['paths_driven'] == 4
    assert policy.learner['name'] == NAME
    assert policy.visits.sum() >= 4
