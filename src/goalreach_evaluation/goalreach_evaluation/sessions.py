"""Driving a policy many times through the full sensor chain, on as many processes as wanted.

Paths are driven in sessions: one robot with its own drawn errors drives up to 22 paths. A
session depends on its number and the seed alone, so the result does not depend on the number
of processes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
import functools
import multiprocessing
from typing import Final, TypeVar

import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_evaluation.path_metrics import PathResult
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Pose2

_Argument = TypeVar('_Argument')
_Result = TypeVar('_Result')


def each(
    function: Callable[[_Argument], _Result], arguments: Sequence[_Argument], *, jobs: int = 1
) -> Iterator[_Result]:
    """Yield what a function makes of each argument, in their order.

    Args:
        function: At the top of a module, so that another process finds it.
        arguments: What it is called with.
        jobs: Number of processes; with one, it is called in this process.
    """
    if jobs == 1:
        yield from map(function, arguments)
        return
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(max_workers=jobs, mp_context=context) as pool:
        yield from pool.map(function, arguments)


SESSION_PATHS: Final = 22
"""Paths that one robot with its own drawn errors drives; chosen."""


@dataclass(frozen=True, kw_only=True)
class EvaluationPlan:
    """What is to be driven.

    Attributes:
        arena: Where.
        noise: How far the sensors may be wrong.
        policy: What was learned.
        controller: How it is driven.
        starts: Where the paths begin.
        seed: Seed of everything random.
    """

    arena: Arena
    noise: NoiseModel
    policy: Policy
    controller: ControllerConfig
    starts: Sequence[Pose2]
    seed: int

    @property
    def sessions(self) -> int:
        """Number of sessions."""
        return -(-len(self.starts) // SESSION_PATHS)


@dataclass(frozen=True, kw_only=True)
class SessionResult:
    """What one session yields: its paths in order, and the camera frames it took."""

    paths: tuple[PathResult, ...]
    frames: int


def drive_session(plan: EvaluationPlan, number: int) -> SessionResult:
    """Drive one session of a plan.

    Args:
        plan: What is to be driven.
        number: Which session, from 0.
    """
    first = number * SESSION_PATHS
    drive = InProcessDrive(
        arena=plan.arena,
        noise=plan.noise,
        policy=plan.policy,
        controller=plan.controller,
        seed=np.random.SeedSequence(plan.seed, spawn_key=(number,)),
    )
    paths = tuple(
        drive.drive(start, path=first + index)
        for index, start in enumerate(plan.starts[first : first + SESSION_PATHS])
    )
    return SessionResult(paths=paths, frames=drive.frames)


def evaluate(
    plan: EvaluationPlan, *, jobs: int = 1, progress: Callable[[int], None] = lambda _: None
) -> list[SessionResult]:
    """Drive a whole plan.

    Args:
        plan: What is to be driven.
        jobs: Number of processes.
        progress: Called with the number of paths that each finished session adds.

    Returns:
        The sessions in order.
    """
    results: list[SessionResult] = []
    drive = functools.partial(drive_session, plan)
    for result in each(drive, range(plan.sessions), jobs=jobs):
        results.append(result)
        progress(len(result.paths))
    return results
