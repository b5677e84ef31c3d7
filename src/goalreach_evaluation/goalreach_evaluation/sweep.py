"""One piece of a sweep: learn in an arena, drive with some noise, count what came of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
import importlib.util
import multiprocessing
from typing import Any

import numpy as np

from goalreach_evaluation.sessions import EvaluationPlan, evaluate
from goalreach_evaluation.starts import RunSeeds, random_starts
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NoiseModel


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


@contextmanager
def processes(jobs: int) -> Iterator[Executor]:
    """Open processes on this machine."""
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(max_workers=jobs, mp_context=context) as executor:
        yield executor


@contextmanager
def dask_workers(jobs: int, address: str | None = None) -> Iterator[Executor]:
    """Open the workers of a Dask cluster.

    Args:
        jobs: Number of workers of a cluster on this machine.
        address: A scheduler that runs already, whose workers can import goalreach; None for a
            cluster on this machine that ends with the sweep.

    Raises:
        GoalreachError: Dask is not installed, or the scheduler does not answer.
    """
    if importlib.util.find_spec('distributed') is None:
        raise GoalreachError('dask is not installed: pip install goalreach[dask]')
    import distributed

    try:
        if address is not None:
            client = distributed.Client(address)
        else:
            client = distributed.Client(
                n_workers=jobs, threads_per_worker=1, host='127.0.0.1', dashboard_address=None
            )
    except OSError as error:
        raise GoalreachError(f'{address}: does not answer: {error}') from None
    with client, client.get_executor(pure=False, retries=2) as executor:
        yield executor


def lost_work() -> tuple[type[BaseException], ...]:
    """Return the exceptions that say a worker died, not that its work cannot be done."""
    lost: tuple[type[BaseException], ...] = (BrokenProcessPool, CancelledError)
    if importlib.util.find_spec('distributed') is not None:
        from distributed.scheduler import KilledWorker

        lost += (KilledWorker,)
    return lost


def run_sweep(
    cases: Sequence[SweepCase],
    open_executor: Callable[[], AbstractContextManager[Executor]],
    keep: Callable[[dict[str, Any]], None],
    *,
    attempts: int = 3,
    drive: Callable[[SweepCase], dict[str, Any]] = drive_case,
) -> None:
    """Run all cases; a case whose worker died is run again.

    Args:
        cases: What to do.
        open_executor: Opens where it is done; anew after a worker's death has closed it.
        keep: Called with each result as soon as it is there.
        attempts: How often to open it before giving up.
        drive: What to do with a case.

    Raises:
        GoalreachError: Workers kept dying; what was finished has been kept.
    """
    left = list(cases)
    for _ in range(attempts):
        if not left:
            return
        with open_executor() as executor:
            waiting = {executor.submit(drive, case): case for case in left}
            for future in as_completed(waiting):
                try:
                    result = future.result()
                except lost_work():
                    continue
                keep(result)
                left.remove(waiting[future])
    if left:
        raise GoalreachError(f'workers keep dying: {len(left)} of {len(cases)} cases are not done')
