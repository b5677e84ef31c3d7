"""A driving study: one policy, one mode, one noise, many starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Final

import numpy as np

from goalreach_evaluation.path_metrics import PathResult
from goalreach_evaluation.sessions import SESSION_PATHS, EvaluationPlan, SessionResult
from goalreach_evaluation.starts import RunSeeds, border_starts, random_starts
from goalreach_lab.reproduction.driving import distance_to_goal
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset

OUTCOMES: Final = ('goal', 'bump', 'false-goal', 'timeout')


@dataclass(frozen=True, kw_only=True)
class Study:
    """What one study drives.

    Attributes:
        name: Name of the study and of its results.
        arena: Where.
        policy: What is driven.
        mode: How the heading is chosen.
        noise: Name of the noise.
        kind: 'random' starts over the floor, or at the 'border'.
        paths: At least how many paths; whole sessions of 22 are driven.
        seed: Seed of starts and noise.
    """

    name: str
    arena: Arena
    policy: Policy
    mode: str = 'fuzzy'
    noise: str = 'nominal'
    kind: str = 'random'
    paths: int = 22
    seed: int = 0

    @property
    def sessions(self) -> int:
        """Number of sessions."""
        return -(-self.paths // SESSION_PATHS)

    def plan(self) -> EvaluationPlan:
        """Return the plan of the study; more paths begin with the same ones."""
        seeds = RunSeeds.spawn(self.seed)
        draw = random_starts if self.kind == 'random' else border_starts
        count = self.sessions * SESSION_PATHS
        return EvaluationPlan(
            arena=self.arena,
            noise=noise_preset(self.noise),
            policy=self.policy,
            controller=ControllerConfig(mode=self.mode),
            starts=draw(self.arena, count, np.random.default_rng(seeds.starts)),
            seed=seeds.simulator,
        )


@dataclass(frozen=True, kw_only=True)
class DrivenPath:
    """What the document needs of a path.

    Attributes:
        outcome: One of `OUTCOMES`.
        duration_s: Time.
        length_m: Length.
        turning_deg: Total turning.
        step_deg: Largest change of the commanded heading in a control step, once under way.
        shortest_m: Length of the shortest path into the goal.
        error_rms_m: Error of the estimated position.
    """

    outcome: str
    duration_s: float
    length_m: float
    turning_deg: float
    step_deg: float
    shortest_m: float
    error_rms_m: float


def driven_paths(session: SessionResult, arena: Arena) -> list[DrivenPath]:
    """Return the paths of a session."""
    return [_driven(path, arena) for path in session.paths]


def _driven(path: PathResult, arena: Arena) -> DrivenPath:
    return DrivenPath(
        outcome=path.outcome,
        duration_s=round(path.duration_s, 3),
        length_m=round(path.length_m, 4),
        turning_deg=round(math.degrees(path.turning_rad), 3),
        step_deg=round(math.degrees(path.max_heading_step_rad), 3),
        shortest_m=round(distance_to_goal(path.start, arena.regions), 4),
        error_rms_m=round(path.pose_error_m['rms'], 5),
    )


def goals(paths: Sequence[DrivenPath]) -> list[DrivenPath]:
    """Return the paths that reached the goal."""
    return [path for path in paths if path.outcome == 'goal']
