"""One piece of a sweep: learn in an arena, drive with some noise, count what came of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from goalreach_bringup.evaluation import EvaluationPlan, evaluate
from goalreach_bringup.run.plan import RunSeeds, random_starts
from goalreach_learning.controller import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel

__all__ = ['SweepCase', 'drive_case']


@dataclass(frozen=True, kw_only=True)
class SweepCase:
    """What one worker does at a time; it holds all that is needed, on whatever machine.

    Attributes:
        arena_name: What the arena is called in the results.
        arena: Where to learn and drive.
        noise_name: What the noise is called in the results.
        noise: How far the sensors may be wrong.
        mode: How the heading is chosen.
        drives: Number of random starts.
        seed: Seed of everything random.
    """

    arena_name: str
    arena: Arena
    noise_name: str
    noise: NoiseModel
    mode: str
    drives: int
    seed: int

    @property
    def key(self) -> dict[str, Any]:
        """What tells this case from others in a file of results."""
        return {
            'arena': self.arena_name,
            'noise': self.noise_name,
            'mode': self.mode,
            'drives': self.drives,
            'seed': self.seed,
        }


def drive_case(case: SweepCase) -> dict[str, Any]:
    """Learn and drive; return the case's key, and how many paths had which outcome."""
    seeds = RunSeeds.spawn(case.seed)
    starts = random_starts(case.arena, case.drives, np.random.default_rng(seeds.starts))
    plan = EvaluationPlan(
        arena=case.arena,
        noise=case.noise,
        policy=train(case.arena, rng=np.random.default_rng(seeds.training)).policy,
        controller=ControllerConfig(mode=case.mode),
        starts=starts,
        seed=seeds.simulator,
    )
    sessions = evaluate(plan)
    paths = [path for session in sessions for path in session.paths]
    return {
        **case.key,
        'outcomes': dict(Counter(path.outcome for path in paths)),
        'sim_time_s': sum(path.duration_s for path in paths),
        'frames': sum(session.frames for session in sessions),
    }
