"""The ticks of a path that is being driven, in little room: a long path has thousands."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Final, overload

from goalreach_msgs_py.values import Pose2

_NAN: Final = math.nan
_WIDTH: Final = 7
"""Numbers of a tick: the two poses and the heading."""


@dataclass(frozen=True, kw_only=True)
class Tick:
    """What is known of one stamp.

    Attributes:
        time_ns: The stamp.
        truth: True pose.
        estimate: Estimated pose, or None where the state was not trusted.
        commanded_heading_rad: Heading that the controller wanted, or None.
    """

    time_ns: int
    truth: Pose2
    estimate: Pose2 | None
    commanded_heading_rad: float | None


class TickLog(Sequence[Tick]):
    """Ticks in the order of their stamps, 64 bytes each."""

    def __init__(self) -> None:
        """Begin with none."""
        self._stamps_ns = array('q')
        self._numbers = array('d')

    def append(self, tick: Tick) -> None:
        """Add a tick later than all that are there."""
        self._stamps_ns.append(tick.time_ns)
        heading_rad = tick.commanded_heading_rad
        self._numbers.extend(
            (
                *_row(tick.truth),
                *_row(tick.estimate),
                _NAN if heading_rad is None else heading_rad,
            )
        )

    def take_until(self, time_ns: int) -> TickLog:
        """Remove the ticks up to a stamp, that one included, and return them."""
        count = bisect_right(self._stamps_ns, time_ns)
        taken = self[:count]
        del self._stamps_ns[:count]
        del self._numbers[: count * _WIDTH]
        return taken

    def __len__(self) -> int:
        return len(self._stamps_ns)

    @overload
    def __getitem__(self, index: int) -> Tick: ...
    @overload
    def __getitem__(self, index: slice) -> TickLog: ...
    def __getitem__(self, index: int | slice) -> Tick | TickLog:
        if isinstance(index, slice):
            begin, end, step = index.indices(len(self))
            if step != 1:
                raise ValueError(f'a row of ticks is cut in steps of 1, not {step}')
            part = TickLog()
            part._stamps_ns = self._stamps_ns[begin:end]
            part._numbers = self._numbers[begin * _WIDTH : end * _WIDTH]
            return part
        number = range(len(self))[index]
        row = self._numbers[number * _WIDTH : (number + 1) * _WIDTH]
        return Tick(
            time_ns=self._stamps_ns[number],
            truth=_pose(row[:3]),
            estimate=None if math.isnan(row[3]) else _pose(row[3:6]),
            commanded_heading_rad=None if math.isnan(row[6]) else row[6],
        )


def _row(pose: Pose2 | None) -> tuple[float, float, float]:
    return (_NAN, _NAN, _NAN) if pose is None else (pose.x_m, pose.y_m, pose.heading_rad)


def _pose(row: Sequence[float]) -> Pose2:
    x_m, y_m, heading_rad = row
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
