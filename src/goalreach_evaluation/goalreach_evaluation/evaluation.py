"""Evaluations: many paths on many processes, from the request to the summary.

Paths are driven in sessions. A session is one robot, with sensor errors of its own, that drives up
to 22 paths. It depends on its number and the seed alone, so the result does not depend on the
number of processes.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
import functools
import math
import multiprocessing
from pathlib import Path
import time
from typing import Any, Final

import numpy as np

from goalreach_evaluation.choices import choose_arena, choose_noise, choose_policy
from goalreach_evaluation.drive import InProcessDrive
from goalreach_evaluation.path_metrics import PathResult, PathTally
from goalreach_evaluation.starts import RunSeeds, choose_starts
from goalreach_evaluation.summary_file import summarise, write_summary
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Pose2

SESSION_PATHS: Final = 22
"""Paths of one session. Chosen."""


@dataclass(frozen=True, kw_only=True)
class EvaluationPlan:
    """Everything that determines the paths of an evaluation, one from each start."""

    arena: Arena
    noise: NoiseModel
    policy: Policy
    controller: ControllerConfig
    starts: Sequence[Pose2]
    seed: int

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
    """Drive one session of a plan, by its number from 0."""
    first = number * SESSION_PATHS
    drive = plan.session_drive(number)
    paths = tuple(
        drive.drive(start, path=first + index)
        for index, start in enumerate(plan.starts[first : first + SESSION_PATHS])
    )
    return SessionResult(paths=paths, frames=drive.frames)


def processes(jobs: int) -> Executor:
    """Return processes on this machine, which end with its context."""
    context = multiprocessing.get_context('spawn')
    return ProcessPoolExecutor(max_workers=jobs, mp_context=context)


def drive_sessions(
    plan: EvaluationPlan, *, jobs: int = 1, progress: Callable[[int], None] = lambda _: None
) -> list[SessionResult]:
    """Drive every session of a plan in `jobs` processes; return the results in order.

    `progress` is called with the number of paths that each finished session adds.
    """
    results: list[SessionResult] = []
    sessions = range(math.ceil(len(plan.starts) / SESSION_PATHS))
    with processes(jobs) if jobs > 1 else nullcontext() as pool:
        run: Callable[..., Iterator[SessionResult]] = map if pool is None else pool.map
        for result in run(functools.partial(drive_session, plan), sessions):
            results.append(result)
            progress(len(result.paths))
    return results


@dataclass(frozen=True, kw_only=True)
class EvaluationRequest:
    """What to evaluate, by name, by file or as objects.

    Attributes:
        policy: Policy, its name or its file; None to learn one first.
        arena: Name, file or object.
        starts: 'paper', 'random:N', 'border:N' or poses in `map`.
        noise: Name of a preset, file or object.
        mode: How the heading is chosen: one of `blending.MODES`.
        seed: Seed of every random draw.
    """

    policy: Policy | Path | str | None = None
    arena: Arena | Path | str = 'paper'
    starts: Sequence[Pose2] | str = 'paper'
    noise: NoiseModel | Path | str = 'nominal'
    mode: str = 'fuzzy'
    seed: int = 0

    @functools.cached_property
    def plan(self) -> EvaluationPlan:
        """The request with names resolved, files read, and a policy learned if none is given.

        Raises:
            GoalreachError: A value or a file is refused.
        """
        if self.seed < 0:
            raise ConfigurationError('seed', self.seed, 'a whole number >= 0')
        arena = choose_arena(self.arena)
        seeds = RunSeeds.spawn(self.seed)
        return EvaluationPlan(
            arena=arena,
            noise=choose_noise(self.noise),
            policy=choose_policy(self.policy, arena, seeds.training),
            controller=ControllerConfig(mode=self.mode),
            starts=choose_starts(self.starts, arena, seeds.starts),
            seed=seeds.simulator,
        )


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """The driven paths of an evaluation in the order of their starts, and the camera frames."""

    request: EvaluationRequest
    paths: Sequence[PathResult]
    frames: int
    wall_time_s: float

    @property
    def tally(self) -> PathTally:
        """Counts and means over the paths."""
        return PathTally.of(self.paths)

    @property
    def success_rate(self) -> float:
        """Share of the paths that reached the goal, judged by the true position."""
        return self.tally.goals / len(self.paths)

    def to_json(self) -> dict[str, Any]:
        """Return the summary that `goalreach evaluate --json` writes."""
        request = self.request
        return summarise(
            self.paths,
            seed=request.seed,
            mode=request.mode,
            policy=_label(request.policy),
            sim_time_s=self.tally.total['duration_s'],
            wall_time_s=self.wall_time_s,
            config={
                'arena': _label(request.arena),
                'noise': _label(request.noise),
                'starts': _label(request.starts),
                'frames': self.frames,
            },
        )

    def write(self, path: Path | str) -> None:
        """Write the summary as JSON.

        Raises:
            FileFormatError: The file cannot be written.
        """
        write_summary(path, self.to_json())


def _label(value: object) -> str:
    """Return how the summary names a part of a request."""
    if value is None:
        return 'learned'
    if isinstance(value, Arena):
        return value.name
    return str(value) if isinstance(value, (str, Path)) else 'in memory'


def evaluate(
    request: EvaluationRequest, *, jobs: int = 1, progress: Callable[[int], None] = lambda _: None
) -> Evaluation:
    """Drive every path of a request; the result is the same for any number of processes.

    `progress` is called with the number of paths that each finished session adds.

    Raises:
        GoalreachError: A value or a file is refused.
    """
    if jobs < 1:
        raise ConfigurationError('jobs', jobs, 'a whole number >= 1')
    plan = request.plan
    began_s = time.perf_counter()
    sessions = drive_sessions(plan, jobs=jobs, progress=progress)
    return Evaluation(
        request=request,
        paths=[path for session in sessions for path in session.paths],
        frames=sum(session.frames for session in sessions),
        wall_time_s=time.perf_counter() - began_s,
    )
