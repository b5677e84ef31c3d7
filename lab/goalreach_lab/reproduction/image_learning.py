"""Learning with camera images in the loop, in one process."""

from __future__ import annotations

import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_evaluation.starts import RunSeeds
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset


def learn_with_images(arena: Arena, noise: str, seed: int, trials: int) -> Policy:
    """Return what the learning phase learns when every step goes through images.

    Args:
        arena: Where.
        noise: Name of the noise.
        seed: Seed of everything random.
        trials: Trials of one path from every start.
    """
    learning = LearningConfig(trials=trials)
    drive = InProcessDrive(
        arena=arena,
        noise=noise_preset(noise),
        policy=Policy.unlearned(arena.regions),
        controller=ControllerConfig(mode='crisp', learn=True, learning=learning),
        seed=np.random.SeedSequence(RunSeeds.spawn(seed).simulator),
    )
    for path in range(trials * len(arena.starts)):
        drive.drive(
            arena.starts[path % len(arena.starts)], path=path, trial=path // len(arena.starts)
        )
    return drive.learned
