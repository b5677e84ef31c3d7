"""A controller of one's own drives the robot, and goalreach judges its paths."""

from collections.abc import Iterator
from pathlib import Path
import subprocess
import sys

import pytest

import graphs

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / 'examples' / 'own_controller.py'
EXTERNAL = '--external goal_reaching_controller'


@pytest.fixture
def domain(tmp_path: Path) -> Iterator[int]:
    """Give a domain in which the example runs."""
    domain = graphs.fresh_domain()
    environment = graphs.graph_environment(domain, tmp_path)
    with subprocess.Popen([sys.executable, str(EXAMPLE)], env=environment) as process:
        yield domain
        process.terminate()
        try:
            assert process.wait(timeout=20) == 0
        finally:
            process.kill()


@pytest.mark.graph
def test_the_example_reaches_the_goal(domain: int, tmp_path: Path) -> None:
    options = ['--policy', 'paper', '--paths', '2', '--clock', 'lockstep', '--no-dashboard']
    arguments = ['run', *options, '--start', '0.9,3.5,90', '--start', '2.7,2.0,0']
    with graphs.goalreach([*arguments, *EXTERNAL.split()], domain=domain, home=tmp_path) as run:
        output, _ = run.communicate(timeout=100)

    assert run.returncode == 0, output
    assert '2 of 2 paths reached the goal' in output


@pytest.mark.graph
def test_its_runs_in_lockstep_repeat(domain: int, tmp_path: Path) -> None:
    bags = [str(tmp_path / name) for name in ('one', 'two')]
    options = ['--policy', 'paper', '--paths', '2', '--clock', 'lockstep', '--no-dashboard']
    for bag in bags:
        arguments = ['run', *options, *EXTERNAL.split(), '--seed', '7', '--record', bag]
        with graphs.goalreach(arguments, domain=domain, home=tmp_path) as run:
            output, _ = run.communicate(timeout=100)
        assert run.returncode == 0, output
    with graphs.goalreach(['bag', 'compare', *bags], domain=domain, home=tmp_path) as compare:
        output, _ = compare.communicate(timeout=60)
    assert compare.returncode == 0, output


def test_the_documents_show_the_example() -> None:
    page = (ROOT / 'docs' / 'how-to' / 'controller.md').read_text()
    text = EXAMPLE.read_text()
    core = text[text.index('class ') : text.index('def main')].rstrip()

    assert f'```python\n{core}\n```' in page
    assert EXTERNAL in page
    assert EXTERNAL in text
