"""What a person asked a run to be."""

from __future__ import annotations

from dataclasses import dataclass
import math
from pathlib import Path
from typing import Final

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Pose2

MODES: Final = ('fuzzy', 'crisp', 'fuzzy-eq3', 'fuzzy-as-printed')
_START_NUMBERS = 3


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Options of `run`; None where the person did not say.

    Attributes:
        seed: Seed of everything random.
        policy: Policy file, or None to learn one first.
        arena: Name or file of the arena.
        mode: How to drive, or None for the parameter file's or the default.
        paths: Number of paths, 0 until Ctrl-C.
        starts: 'paper' or 'random'.
        start_poses: Poses given one by one; they replace `starts`.
        clock: 'realtime' or 'lockstep', or None.
        speed: Simulated seconds per wall second, or None.
        noise: Noise preset.
        learn: Whether to learn over the graph.
        composed: Whether all nodes share one process.
        params_file: Parameter file of the person, or None.
        summary: Where to write the summary, or None.
        quiet: Whether to leave out all but errors.
        dashboard: Whether to show the live page; None where that depends on the terminal.
        record: Bag to record, or None.
        storage: Storage format of the bag.
        remaps: Remapping rules of ROS 2, given to every node.
        network: Whether other machines may take part.
    """

    seed: int
    policy: Path | None
    arena: str
    mode: str | None
    paths: int
    starts: str
    start_poses: tuple[Pose2, ...]
    clock: str | None
    speed: float | None
    noise: str
    learn: bool
    composed: bool
    params_file: Path | None
    summary: Path | None
    quiet: bool
    dashboard: bool | None = False
    record: Path | None = None
    storage: str = 'mcap'
    remaps: tuple[str, ...] = ()
    network: bool = False

    def __post_init__(self) -> None:
        """Check what argparse cannot."""
        if self.paths < 0:
            raise ConfigurationError('--paths', self.paths, 'a whole number >= 0')
        if not 0 <= self.seed < 2**31:
            raise ConfigurationError('--seed', self.seed, 'a whole number in [0, 2147483647]')
        for rule in self.remaps:
            if ':=' not in rule:
                raise ConfigurationError('--remap', rule, 'FROM:=TO or NODE:FROM:=TO')


def parse_start(text: str) -> Pose2:
    """Return the pose of `X,Y,HEADING_DEG` (metres, metres, degrees).

    Raises:
        ConfigurationError: The text is not three finite numbers.
    """
    try:
        numbers = [float(part) for part in text.split(',')]
    except ValueError:
        numbers = []
    if len(numbers) != _START_NUMBERS or not all(map(math.isfinite, numbers)):
        raise ConfigurationError('--start', text, 'X,Y,HEADING_DEG in metres and degrees')
    return Pose2(x_m=numbers[0], y_m=numbers[1], heading_rad=math.radians(numbers[2]))
