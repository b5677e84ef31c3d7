"""Learn the weight of `avoid` in a blend of behaviours, by the learning rule of the project.

An episode of `BlendEnv` is one path among random obstacles, with images and noise in the loop. Its
reward is 1 for the goal, less a tenth for each bump and for each minute. Equations (1) and (2) of
the paper then learn which weight is best: python examples/learned_blend.py --paths 200
"""

import argparse
import math
from typing import Any

import gymnasium
import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy_file import read_policy
from goalreach_learning.q_learning import LearningConfig, boltzmann_probabilities, q_update
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import Pose2

WEIGHTS = (0.001, 0.003, 0.01, 1.0)
START = Pose2(x_m=1.75, y_m=4.4, heading_rad=-math.pi / 2)


class BlendEnv(gymnasium.Env[int, int]):
    """One path among three random cylinders; the action is the weight of `avoid`."""

    observation_space: Any = gymnasium.spaces.Discrete(1)
    action_space: Any = gymnasium.spaces.Discrete(len(WEIGHTS))

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:  # noqa: ANN401 - as in Gymnasium
        """Place other obstacles, clear of start and goal."""
        super().reset(seed=seed, options=options)
        places = self.np_random.uniform((0.6, 2.3), (2.9, 3.4), (3, 2)).tolist()
        cylinders = tuple(Obstacle(x_m=x_m, y_m=y_m, radius_m=0.12) for x_m, y_m in places)
        self.arena = Arena(obstacles=cylinders, starts=(START,))
        return 0, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Drive the path."""
        text = f'first(escape, blend({WEIGHTS[action]}*avoid, patience, goal))'
        drive = InProcessDrive(
            arena=self.arena,
            noise=noise_preset('nominal'),
            policy=read_policy('paper'),
            controller=ControllerConfig(behaviors=text),
            seed=np.random.SeedSequence(int(self.np_random.integers(2**31))),
        )
        pressed, bumps = False, 0
        for frame in drive.drive_frames(START):
            bumps += any(frame.sensors.bumpers) and not pressed
            pressed = any(frame.sensors.bumpers)
        outcome = frame.result.outcome if frame.result else ''
        reward = float(outcome == 'goal') - 0.1 * bumps - drive.frames / 15000.0
        return 0, reward, True, False, {'outcome': outcome, 'bumps': bumps}


def learn(paths: int, seed: int) -> list[float]:
    """Return the learned value of each weight."""
    env, rng, values = BlendEnv(), np.random.default_rng(seed), [0.0] * len(WEIGHTS)
    config = LearningConfig(trials=paths)
    for path in range(paths):
        env.reset(seed=seed if path == 0 else None)
        chances = boltzmann_probabilities(values, config.temperature(path))
        action = int(rng.choice(len(WEIGHTS), p=chances))
        _, reward, *_ = env.step(action)
        values[action] = q_update(values[action], reward, [], alpha=0.2, gamma=config.gamma)
    return values


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description='Learn the weight of avoid in a blend.')
    parser.add_argument('--paths', type=int, default=100)
    for weight, value in zip(WEIGHTS, learn(parser.parse_args().paths, seed=0), strict=True):
        print(f'{weight:g}*avoid: {value:.2f}')
