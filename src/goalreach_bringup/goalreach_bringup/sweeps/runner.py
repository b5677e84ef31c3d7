"""Running the cases of a sweep; whatever dies, what is finished is kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import AbstractContextManager
from typing import Any

from goalreach_bringup.sweeps.case import SweepCase, drive_case
from goalreach_bringup.sweeps.executors import lost_work
from goalreach_msgs_py.errors import GoalreachError

__all__ = ['run_sweep']


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
