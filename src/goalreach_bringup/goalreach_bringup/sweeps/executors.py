"""Where a sweep runs: executors of the standard library's interface, opened and closed."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
import importlib.util
import multiprocessing

from goalreach_msgs_py.errors import GoalreachError

__all__ = ['dask_workers', 'lost_work', 'processes']


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
