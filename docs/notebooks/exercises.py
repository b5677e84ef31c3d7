"""Prints whether the answer to an exercise of a notebook is right."""

from collections.abc import Callable


def report(number: int, check: Callable[[], bool], hint: str) -> None:
    """Print whether an answer is right; never raises for a wrong one.

    Args:
        number: Number of the exercise.
        check: Returns whether the answer is right. An exception counts as a wrong answer.
        hint: What to look at while it is not.
    """
    try:
        right = bool(check())
    except Exception as error:  # noqa: BLE001 - the reader's code may fail in any way
        right, hint = False, f'{hint} ({type(error).__name__}: {error})'
    print(f'Exercise {number}: right' if right else f'Exercise {number}: not yet. {hint}')
