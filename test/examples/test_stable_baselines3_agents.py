from pathlib import Path
from types import ModuleType

import pytest

from modules import load_module

pytest.importorskip('gymnasium')
pytest.importorskip('stable_baselines3', reason='needs the extra sb3 (torch): goalreach[sb3]')

EXAMPLE = Path(__file__).parents[2] / 'examples' / 'stable_baselines3_agents.py'


@pytest.fixture(scope='module')
def example() -> ModuleType:
    return load_module(EXAMPLE)


@pytest.mark.parametrize('name', ['dqn', 'ppo'])
@pytest.mark.parametrize('observation', ['region', 'memberships'])
def test_an_agent_trains_on_a_small_budget(
    example: ModuleType, name: str, observation: str
) -> None:
    agent = example.make_agent(name, seed=0, observation=observation)
    agent.learn(256)
    assert agent.num_timesteps >= 256
    assert len(example.successes(agent, observation=observation)) == 22


def test_the_command_prints_how_many_starts_reach_the_goal(
    example: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    assert example.main(['--agent', 'dqn', '--steps', '50']) == 1
    assert 'of 22 starts reach the goal' in capsys.readouterr().out
