"""Sweeps: cases measured in parallel.

A case is one learning phase and drives from random starts, or one learner that learns until its
policy leads to the goal from every start.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
import importlib.util
from typing import Any, Final, TypeVar

import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_evaluation.evaluation import EvaluationRequest, evaluate
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import LearningPhase
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Pose2

_Case = TypeVar('_Case')
_Result = TypeVar('_Result')
_Drive = Callable[[Pose2, int, int], tuple[str, float, float]]
"""From start, trial and path to the path's outcome, length (m) and time (s)."""

_ATTEMPTS: Final = 3
"""How often workers are started before giving up. Chosen."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """What every case has; with that of its class, everything a worker on any machine needs.

    Attributes:
        arena_name: Name of the arena in the results.
        arena: The arena.
        noise_name: Name of the noise in the results.
        noise: Errors of the sensors, with images in the loop; None to drive without simulating
            time and without errors.
        seed: Seed of every random draw.
    """

    arena_name: str
    arena: Arena
    noise_name: str
    noise: NoiseModel | None
    seed: int


@dataclass(frozen=True, kw_only=True)
class SweepCase(Case):
    """One learning phase and drives with images.

    Attributes:
        mode: How the heading is chosen.
        drives: Number of random starts.
    """

    noise: NoiseModel
    mode: str
    drives: int

    @property
    def key(self) -> dict[str, Any]:
        """The fields that identify this case in a file of results."""
        key = {'arena': self.arena_name, 'noise': self.noise_name, 'mode': self.mode}
        return {**key, 'drives': self.drives, 'seed': self.seed}


def drive_case(case: SweepCase) -> dict[str, Any]:
    """Learn and drive; return the key of the case and the number of paths of each outcome."""
    request = EvaluationRequest(
        arena=case.arena,
        starts=f'random:{case.drives}',
        noise=case.noise,
        mode=case.mode,
        seed=case.seed,
    )
    evaluation = evaluate(request)
    return {
        **case.key,
        'outcomes': dict(Counter(path.outcome for path in evaluation.paths)),
        'sim_time_s': sum(path.duration_s for path in evaluation.paths),
        'frames': evaluation.frames,
    }


@dataclass(frozen=True, kw_only=True)
class CurveCase(Case):
    """One learner from nothing, with starts in random order, every start once in each trial.

    Attributes:
        learner: Name of the learner.
        limit: Largest number of paths until the policy leads to the goal from every start.
        after: Number of further paths, during which it should not lose that.
    """

    learner: str
    limit: int
    after: int

    @property
    def key(self) -> dict[str, Any]:
        """The fields that identify this case in a file of results."""
        key = {'learner': self.learner, 'arena': self.arena_name, 'noise': self.noise_name}
        return {**key, 'limit': self.limit, 'after': self.after, 'seed': self.seed}


def learn_case(case: CurveCase) -> dict[str, Any]:
    """Learn until the greedy policy leads to the goal from every start, and on.

    Returns:
        The key of the case; `learned`; until then `paths`, `bumps`, `length_m` and `time_s`; and
        `lost`, the number of later paths after which the policy failed from a start.

    Raises:
        ConfigurationError: There is no such learner.
    """
    rng = np.random.default_rng([case.seed, 0])
    drive, policy = _simulated(case) if case.noise is None else _with_images(case, case.noise)
    total, needed, learned = np.zeros(4), np.zeros(4), False
    lost, order = 0, rng.permutation(len(case.arena.starts))
    for path in range(case.limit + case.after):
        trial, place = divmod(path, len(order))
        order = rng.permutation(order) if place == 0 else order
        outcome, length_m, time_s = drive(case.arena.starts[order[place]], trial, path)
        total += (1, outcome == 'bump', length_m, time_s)
        good = all(greedy_successes(case.arena, policy()))
        if not learned:
            needed, learned = total.copy(), good
        lost += learned and not good
        if path + 1 == (needed[0] + case.after if learned else case.limit):
            break
    names = ('paths', 'bumps', 'length_m', 'time_s')
    found = dict(zip(names, needed.tolist(), strict=True))
    return {**case.key, 'learned': learned, **found, 'lost': int(lost)}


def _simulated(case: CurveCase) -> tuple[_Drive, Callable[[], Policy]]:
    config, rng = LearningConfig(), np.random.default_rng([case.seed, 1])
    agent = Agent(case.learner, case.arena.regions, config, rng)
    phase = LearningPhase(case.arena, config, agent, rng)

    def drive(start: Pose2, trial: int, path: int) -> tuple[str, float, float]:
        outcome, _, length_m = phase.run(start, trial, path)
        return outcome.value, length_m, 0.0

    return drive, lambda: agent.policy


def _with_images(case: CurveCase, noise: NoiseModel) -> tuple[_Drive, Callable[[], Policy]]:
    loop = InProcessDrive(
        arena=case.arena,
        noise=noise,
        policy=Policy.unlearned(case.arena.regions),
        controller=ControllerConfig(learn=True, learner=case.learner),
        seed=np.random.SeedSequence(case.seed),
    )

    def drive(start: Pose2, trial: int, path: int) -> tuple[str, float, float]:
        result = loop.drive(start, path=path, trial=trial)
        return result.outcome, result.length_m, result.duration_s

    return drive, lambda: loop.learned


@contextmanager
def dask_workers(jobs: int, address: str | None = None) -> Iterator[Executor]:
    """Open the workers of a Dask cluster.

    `address` is that of a running scheduler, whose workers can import goalreach; without it,
    `jobs` workers are started on this machine, and end with the sweep.

    Raises:
        GoalreachError: Dask is not installed, or the scheduler does not answer.
    """
    if importlib.util.find_spec('distributed') is None:
        raise GoalreachError('--engine dask needs distributed: pip install distributed')
    import distributed

    try:
        if address is not None:
            client = distributed.Client(address)
        else:
            client = distributed.Client(
                n_workers=jobs, threads_per_worker=1, host='127.0.0.1', dashboard_address=None
            )
    except (OSError, ValueError) as error:  # the latter: no address, such as one without a port
        raise GoalreachError(f'{address or "dask"}: does not answer: {error}') from None
    with client, client.get_executor(pure=False, retries=2) as executor:
        yield executor


def lost_work() -> tuple[type[BaseException], ...]:
    """Return the exceptions that mean a dead worker, not a failure of its work."""
    lost: tuple[type[BaseException], ...] = (BrokenProcessPool, CancelledError)
    if importlib.util.find_spec('distributed') is not None:
        from distributed.scheduler import KilledWorker

        lost += (KilledWorker,)
    return lost


def run_cases(
    cases: Sequence[_Case],
    measure: Callable[[_Case], _Result],
    open_executor: Callable[[], AbstractContextManager[Executor]],
) -> Iterator[tuple[_Case, _Result]]:
    """Measure cases in parallel, by a function at the top level; repeat those whose worker died.

    The executor is opened again after a dead worker has closed it. Each case is yielded with its
    result as soon as it is finished.

    Raises:
        GoalreachError: Workers kept dying; every finished case has been yielded.
    """
    left = list(range(len(cases)))
    for _ in range(_ATTEMPTS):
        if not left:
            return
        with open_executor() as executor:
            waiting = {executor.submit(measure, cases[index]): index for index in left}
            try:
                for future in as_completed(waiting):
                    try:
                        result = future.result()
                    except lost_work():
                        continue
                    left.remove(waiting[future])
                    yield cases[waiting[future]], result
            finally:
                for future in waiting:
                    future.cancel()
    if left:
        raise GoalreachError(f'workers keep dying: {len(left)} of {len(cases)} cases are not done')
