"""Sweeps: cases measured in parallel, each one learning phase and drives from random starts."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
import importlib.util
from typing import Any, Final, TypeVar

from goalreach_evaluation.evaluation import EvaluationRequest, evaluate
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NoiseModel

_Case = TypeVar('_Case')
_Result = TypeVar('_Result')

KEY: Final = ('arena', 'noise', 'mode', 'drives', 'seed')
"""Fields that identify a case in a file of results."""
_ATTEMPTS: Final = 3
"""How often workers are started before giving up. Chosen."""


@dataclass(frozen=True, kw_only=True)
class SweepCase:
    """One case, with everything a worker on any machine needs.

    Attributes:
        arena_name: Name of the arena in the results.
        arena: The arena.
        noise_name: Name of the noise in the results.
        noise: Errors of the sensors.
        mode: How the heading is chosen.
        drives: Number of random starts.
        seed: Seed of every random draw.
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
        """The fields `KEY` of this case."""
        values = (self.arena_name, self.noise_name, self.mode, self.drives, self.seed)
        return dict(zip(KEY, values, strict=True))


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
        raise GoalreachError('--dask needs distributed: pip install distributed')
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
    """Measure cases in parallel; repeat those whose worker died.

    Args:
        cases: The cases.
        measure: Function at the top level of a module that returns the result of a case.
        open_executor: Opens the executor; called again after a dead worker has closed it.

    Yields:
        Each case with its result, as soon as it is finished.

    Raises:
        GoalreachError: Workers kept dying; every finished case has been yielded.
    """
    left = list(range(len(cases)))
    for _ in range(_ATTEMPTS):
        if not left:
            return
        with open_executor() as executor:
            waiting = {executor.submit(measure, cases[index]): index for index in left}
            for future in as_completed(waiting):
                try:
                    result = future.result()
                except lost_work():
                    continue
                left.remove(waiting[future])
                yield cases[waiting[future]], result
    if left:
        raise GoalreachError(f'workers keep dying: {len(left)} of {len(cases)} cases are not done')
