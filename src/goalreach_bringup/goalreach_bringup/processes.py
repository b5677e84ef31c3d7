"""The same function over many arguments, on as many processes as wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
import multiprocessing
from typing import TypeVar

__all__ = ['each']

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
