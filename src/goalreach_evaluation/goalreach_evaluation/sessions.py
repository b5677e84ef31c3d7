"""Many paths on many processes, one simulated robot per session.

A session is one robot, with sensor errors of its own, that drives up to 22 paths. It depends on
its number and the seed alone, so the result does not depend on the number of processes.
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
    """Map a function over arguments, on processes if wanted; yield the results in order.

    Args:
        function: A function at the top of a module, so that another process can import it.
        arguments: One call each.
        jobs: Number of processes; with one, this process does the work.
    """
    if jobs == 1:
        yield from map(function, arguments)
        return
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(max_workers=jobs, mp_context=context) as pool:
        yield from pool.map(function, arguments)


SESSION_PATHS: Final = 22
"""Paths of one session. Chosen."""


@dataclass(frozen=True, kw_only=True)
class EvaluationPlan:
    """Everything that determines the paths of an evaluation.

    Attributes:
        arena: The arena.
        noise: Errors of the sensors.
        policy: The policy to drive.
        controller: Configuration of the controller.
        starts: Starting poses, one path each.
        seed: Seed of every random draw.
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

    def session_drive(self, number: int) -> InProcessDrive:
        """Return the drive of a session, with a robot of its own."""
        return InProcessDrive(
            arena=self.arena,
            noise=self.noise,
            policy=self.policy,
            controller=self.controller,
            seed=np.random.SeedSequence(self.seed, spawn_key=(number,)),
        )


@dataclass(frozen=True, kw_only=True)
class SessionResult:
    """The paths of one session in order, and its number of camera frames."""

    paths: tuple[PathResult, ...]
    frames: int


def drive_session(plan: EvaluationPlan, number: int) -> SessionResult:
    """Drive one session of a plan.

    Args:
        plan: The evaluation.
        number: Number of the session, from 0.
    """
    first = number * SESSION_PATHS
    drive = plan.session_drive(number)
    paths = tuple(
        drive.drive(start, path=first + index)
        for index, start in enumerate(plan.starts[first : first + SESSION_PATHS])
    )
    return SessionResult(paths=paths, frames=drive.frames)


def drive_sessions(
    plan: EvaluationPlan, *, jobs: int = 1, progress: Callable[[int], None] = lambda _: None
) -> list[SessionResult]:
    """Drive every session of a plan.

    Args:
        plan: The evaluation.
        jobs: Number of processes.
        progress: Called with the number of paths that each finished session adds.

    Returns:
        The sessions in order.
    """
    results: list[SessionResult] = []
    for result in each(functools.partial(drive_session, plan), range(plan.sessions), jobs=jobs):
        results.append(result)
        progress(len(result.paths))
    return results
