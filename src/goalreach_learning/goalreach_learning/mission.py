"""Which path comes next: starting poses in order, trial after trial."""

from __future__ import annotations

from dataclasses import dataclass

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.values import Pose2

_NUMBERS_PER_START = 3


@dataclass(frozen=True, kw_only=True)
class MissionConfig:
    """What the controller is to drive, and with which policy."""

    policy: str = parameter(
        '', "Policy file; empty: learn one at start by the paper's procedure, without noise"
    )
    policy_out: str = parameter(
        '', 'Policy file to write after every path while learning; empty: none'
    )
    starts: tuple[float, ...] = parameter(
        (), 'Starting poses x, y, heading, one after the other, m and rad; empty: no placing'
    )
    paths: int = parameter(
        0, 'Number of paths, then stop; 0: without end', minimum=0, maximum=1_000_000
    )
    first_path: int = parameter(
        0, 'Number of the first path, where a learning goes on', minimum=0, maximum=1_000_000
    )
    resume: bool = parameter(
        False, 'Drive the first path from wherever the robot stands: it was placed already'
    )
    consumer: str = parameter(
        '',
        'Node that must miss no transition: the first path waits until it subscribes; empty: none',
    )
    seed: int = parameter(
        0, 'Seed of action selection while learning', minimum=0, maximum=2**31 - 1
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)
        if len(self.starts) % _NUMBERS_PER_START:
            raise ConfigurationError('starts', self.starts, 'three numbers for each start')

    @property
    def start_poses(self) -> tuple[Pose2, ...]:
        """The starting poses in `map`."""
        numbers = iter(self.starts)
        return tuple(
            Pose2(x_m=x, y_m=y, heading_rad=heading)
            for x, y, heading in zip(numbers, numbers, numbers, strict=True)
        )


@dataclass(frozen=True, kw_only=True)
class PathOrder:
    """One path to be driven.

    Attributes:
        path: Number of the path, from 0.
        trial: Number of the trial: one trial drives every start once.
        start: Pose to be placed at, or None to drive from wherever the robot stands.
    """

    path: int
    trial: int
    start: Pose2 | None

    @classmethod
    def number(cls, config: MissionConfig, path: int) -> PathOrder | None:
        """Return the order of a path by its number, or None after the last one."""
        if config.paths and path >= config.paths:
            return None
        starts = config.start_poses
        if starts and config.resume and path == config.first_path:
            return cls(path=path, trial=path // len(starts), start=None)
        if not starts:
            return cls(path=path, trial=path, start=None)
        return cls(path=path, trial=path // len(starts), start=starts[path % len(starts)])
