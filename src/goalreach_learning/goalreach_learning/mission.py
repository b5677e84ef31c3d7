"""The mission: starting poses in order, trial after trial."""

from dataclasses import dataclass

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import Pose2

_NUMBERS_PER_START = 3


@dataclass(frozen=True, kw_only=True)
class PathOrder:
    """One path to be driven.

    Attributes:
        path: Number of the path, from 0.
        trial: Number of the trial: one trial drives every start once.
        start: Pose at which to place the robot, or None for its present pose.
    """

    path: int
    trial: int
    start: Pose2 | None


@dataclass(frozen=True, kw_only=True)
class MissionConfig(Configuration):
    """The paths to drive, and the policy to drive them with."""

    policy: str = parameter(
        '', "Policy, by name or file; empty: learn one by the paper's procedure, without noise"
    )
    policy_out: str = parameter(
        '', 'Policy file to write after every path while learning; empty: none'
    )
    starts: tuple[float, ...] = parameter(
        (), 'Starting poses x, y (m), heading (rad) in turn; empty: the robot is not placed'
    )
    paths: int = parameter(0, 'Number of paths; 0: unlimited', within=(0, 1_000_000))
    first_path: int = parameter(
        0, 'Number of the first path, when learning is resumed', within=(0, 1_000_000)
    )
    resume: bool = parameter(
        False, 'Whether the first path begins at the present pose of the robot'
    )
    consumer: str = parameter(
        '', 'Node whose subscription to the transitions the first path waits for; empty: none'
    )
    seed: int = parameter(0, 'Seed of action selection while learning', within=(0, 2**31 - 1))

    def __post_init__(self) -> None:
        super().__post_init__()
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

    def path_order(self, path: int) -> PathOrder | None:
        """Return the order of a path by its number, or None after the last one."""
        if self.paths and path >= self.paths:
            return None
        starts = self.start_poses
        if not starts:
            return PathOrder(path=path, trial=path, start=None)
        trial, index = divmod(path, len(starts))
        in_place = self.resume and path == self.first_path
        return PathOrder(path=path, trial=trial, start=None if in_place else starts[index])
