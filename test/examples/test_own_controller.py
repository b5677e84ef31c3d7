"""A controller of one's own drives the robot, and goalreach judges its paths."""

from collections.abc import Iterator
from pathlib import Path
import subprocess
import sys

import pytest

import graphs

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / 'examples' / 'own_controller.py'
DISCONNECTED = 'goal_reaching_controller:/cmd_vel:=/unused/cmd_vel'


@pytest.fixture
def domain(tmp_path: Path) -> Iterator[int]:
    """Give a domain in which the example runs."""
    domain = graphs.fresh_domain()
    environment = graphs.graph_environment(domain, tmp_path)
    with subprocess.Popen([sys.executable, str(EXAMPLE)], env=environment) as process:
        yield domain
        process.terminate()
        assert process.wait(timeout=20) == 0


@pytest.mark.graph
def test_the_example_reaches_the_goal(domain: int, tmp_path: Path) -> None:
    options = ['--policy', 'paper', '--paths', '2', '--clock', 'lockstep', '--no-dashboard']
    arguments = ['run', *options, '--start', '0.9,3.5,90', '--start', '2.7,2.0,0']
    with graphs.goalreach(
        [*arguments, '--remap', DISCONNECTED], domain=domain, home=tmp_path
    ) as run:
        output, _ = run.communicate(timeout=100)

    assert run.returncode == 0, output
    assert '2 of 2 paths reached the goal' in output


def test_the_documents_show_the_example() -> None:
    page = (ROOT / 'docs' / 'how-to' / 'controller.md').read_text()
    text = EXAMPLE.read_text()
    core = text[text.index('class ') : text.index('def main')].rstrip()

    assert f'```python\n{core}\n```' in page
    assert DISCONNECTED in page
    assert DISCONNECTED in text
