"""A robot, and a localizer, of one's own in the rest of the graph."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import subprocess
import sys

import pytest

import graphs

EXAMPLES = Path(__file__).parents[2] / 'examples'
LARGEST_LINES = {'own_robot.py': 80, 'own_localizer.py': 70, 'own_controller.py': 60}


@contextmanager
def example(name: str, domain: int, home: Path) -> Iterator[None]:
    """Run an example until the end of the block."""
    environment = graphs.graph_environment(domain, home)
    with subprocess.Popen([sys.executable, str(EXAMPLES / name)], env=environment) as process:
        try:
            yield
        finally:
            process.terminate()
            try:
                assert process.wait(timeout=20) == 0
            finally:
                process.kill()


@pytest.mark.parametrize('name', LARGEST_LINES)
def test_an_example_is_short_and_imports_nothing_of_ours(name: str) -> None:
    text = (EXAMPLES / name).read_text()
    assert len(text.splitlines()) <= LARGEST_LINES[name]
    assert 'import goalreach' not in text
    assert 'from goalreach' not in text


@pytest.mark.graph
def test_a_robot_that_only_moves_and_sees_reaches_the_goal(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    told = ['--params-file', str(EXAMPLES / 'own_robot.yaml')]
    bag = tmp_path / 'bag'
    words = ['run', '--external', 'nomad200', '--policy', 'paper', '--paths', '1', *told]
    words += ['--record', str(bag)]
    with (
        example('own_robot.py', domain, tmp_path),
        graphs.goalreach(['check-robot', *told], domain=domain, home=tmp_path) as check,
    ):
        found, _ = check.communicate(timeout=60)
        assert check.returncode == 0, found
        with graphs.goalreach([*words, '--no-dashboard'], domain=domain, home=tmp_path) as run:
            output, _ = run.communicate(timeout=100)
    assert run.returncode == 0, output
    assert '1 of 1 paths declared in the goal' in output
    for words, told in (
        (['bag', 'info', str(bag)], ['clock:      wall']),
        (['replay', str(bag), '--recompute'], ['/pose', '/landmarks']),
        (['bag', 'plot', str(bag), '--out', str(tmp_path / 'figures')], ['path.png']),
    ):
        with graphs.goalreach(words, domain=graphs.fresh_domain(), home=tmp_path) as command:
            output, _ = command.communicate(timeout=60)
        assert all(word in output for word in told), output


@pytest.mark.graph
def test_dead_reckoning_leads_to_the_goal(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    words = ['run', '--external', 'landmark_localizer', '--policy', 'paper', '--paths', '1']
    words += ['--start', '1.0,3.0,0', '--no-dashboard']
    with (
        example('own_localizer.py', domain, tmp_path),
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
    ):
        output, _ = run.communicate(timeout=100)
    assert run.returncode == 0, output
    assert '1 of 1 paths reached the goal' in output


def test_the_page_names_the_examples() -> None:
    page = (EXAMPLES.parent / 'docs' / 'how-to' / 'robot.md').read_text()
    for name in ('own_robot.py', 'own_localizer.py'):
        assert f'examples/{name}' in page
