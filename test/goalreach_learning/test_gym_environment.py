import subprocess
import sys
import warnings

import numpy as np
import pytest

from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent, Situation
from goalreach_learning.learners.tabular import PaperLearner
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import RegionMap

gymnasium = pytest.importorskip('gymnasium')

from goalreach_learning.gym_environment import (  # noqa: E402 - only where Gymnasium is there
    ENVIRONMENT_ID,
    OBSERVATIONS,
    GoalReachEnv,
)


@pytest.mark.parametrize('observation', OBSERVATIONS)
def test_passes_the_checker_without_a_warning(observation: str) -> None:
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(ENVIRONMENT_ID, observation=observation)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        check_env(env.unwrapped)


def test_one_step_is_one_option() -> None:
    env = GoalReachEnv()
    observation, info = env.reset(options={'start': (0.5, 2.5)})
    assert observation == 3 * 0 + 1
    assert info['region'] == 'LEFT-SIDE/MEDIUM'
    observation, reward, terminated, truncated, info = env.step(np.int64(0))
    assert int(observation) == 3 * 1 + 1
    assert (reward, terminated, truncated) == (0.0, False, False)
    assert info['length_m'] == pytest.approx(1.1811 - 0.5)
    observation, reward, terminated, _, info = env.step(np.int64(6))
    assert int(observation) == 3 * 1 + 0
    assert (reward, terminated) == (1.0, True)
    assert info['is_success']


def test_a_wall_terminates_with_a_penalty() -> None:
    env = GoalReachEnv()
    env.reset(options={'start': (0.5, 2.5)})
    _, reward, terminated, truncated, info = env.step(np.int64(4))
    assert (reward, terminated, truncated, info['is_success']) == (-1.0, True, False, False)


def test_going_to_and_fro_is_truncated() -> None:
    env = gymnasium.make(ENVIRONMENT_ID)
    env.reset(options={'start': (0.5, 2.5)})
    ends = [env.step(np.int64(4 * (k % 2)))[2:4] for k in range(60)]
    assert ends[:59] == [(False, False)] * 59
    assert ends[59] == (False, True)


def test_observations_of_one_place() -> None:
    place = {'start': (1.1811, 2.54)}
    seen = {kind: GoalReachEnv(observation=kind).reset(options=place)[0] for kind in OBSERVATIONS}
    assert seen['region'] == 4
    assert seen['memberships'] == pytest.approx([0.5, 0.5, 0, 0, 1, 0], abs=1e-6)
    assert seen['pose'] == pytest.approx([1.1811 / 3.556, 0.5])


def test_same_seed_same_starts() -> None:
    env = GoalReachEnv(start_jitter_m=0.05)
    places = []
    for _ in range(2):
        first = env.reset(seed=3)[1]['x_m']
        places.append([first, *(env.reset()[1]['x_m'] for _ in range(10))])
    assert places[0] == places[1]
    assert len(set(places[0])) > 5


def test_refuses_invalid_options() -> None:
    with pytest.raises(ConfigurationError, match='observation'):
        GoalReachEnv(observation='smell')
    with pytest.raises(ConfigurationError, match='render_mode'):
        GoalReachEnv(render_mode='human')
    for start in (22, (0.0, 0.0), (1.8, 1.0), (1.0,)):
        with pytest.raises(ConfigurationError, match='start'):
            GoalReachEnv().reset(options={'start': start})


@pytest.mark.parametrize(
    ('module', 'name'),
    [
        ('goalreach_learning.gym_environment', ENVIRONMENT_ID),
        ('gymnasium', f'goalreach_learning.gym_environment:{ENVIRONMENT_ID}'),
    ],
)
def test_importing_registers_the_environment(module: str, name: str) -> None:
    program = f'import {module}, gymnasium; gymnasium.make({name!r})'
    done = subprocess.run(
        [sys.executable, '-W', 'error', '-c', program],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, '')


def test_the_same_learner_learns_on_it() -> None:
    config = LearningConfig()
    env = GoalReachEnv()
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    agent = Agent('paper', RegionMap(), config, rng)
    learner = agent.learner
    assert isinstance(learner, PaperLearner)
    for path in range(440):
        state, _ = env.reset(options={'start': path % 22})
        terminated = False
        for _ in range(60):
            region = divmod(int(state), 3)
            action = agent.choose(Situation(region, x_m=0.0, y_m=0.0, trial=path // 22))
            state, reward, terminated, _, _ = env.step(np.int64(action))
            after = divmod(int(state), 3)
            learner.learn(region, action, reward, after, terminal=terminated)
            if terminated:
                break
    assert all(greedy_successes(Arena(), agent.policy))


def test_a_start_that_is_no_place_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="start = 'left'"):
        GoalReachEnv().reset(options={'start': 'left'})


def test_no_start_is_shifted_into_the_goal() -> None:
    env = GoalReachEnv(start_jitter_m=0.5)
    env.reset(seed=0)
    begun = [env.reset()[1] for _ in range(500)]
    assert 'FRONT/NEAR' not in {info['region'] for info in begun}
    assert len({info['x_m'] for info in begun}) > 300
