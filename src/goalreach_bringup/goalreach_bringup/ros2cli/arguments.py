"""Types of command-line arguments."""

from __future__ import annotations

import argparse
import math


def positive_int(text: str) -> int:
    """Return the integer, which must be 1 or more.

    Raises:
        argparse.ArgumentTypeError: It is not.
    """
    value = non_negative_int(text)
    if value == 0:
        raise argparse.ArgumentTypeError('value must be a positive integer')
    return value


def non_negative_int(text: str) -> int:
    """Return the integer, which must be 0 or more.

    Raises:
        argparse.ArgumentTypeError: It is not.
    """
    if not text.isdecimal():
        raise argparse.ArgumentTypeError('value must be a non-negative integer')
    return int(text)


def positive_float(text: str) -> float:
    """Return the number, which must be finite and more than 0.

    Raises:
        argparse.ArgumentTypeError: It is not.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError('value must be a positive number')
    return value


class TerminatedError(Exception):
    """The command was asked to end, by SIGTERM."""
