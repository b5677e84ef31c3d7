"""How simulated time passes: parameters of the `nomad200` node beside the robot's own."""

from __future__ import annotations

from dataclasses import dataclass

from goalreach_msgs_py.parameters import check_fields, parameter

__all__ = ['TimeConfig']


@dataclass(frozen=True, kw_only=True)
class TimeConfig:
    """Clock, speed and seed of a simulation run."""

    clock: str = parameter(
        'realtime',
        'realtime: follow the wall clock; lockstep: wait for the commands of each image',
        choices=('realtime', 'lockstep'),
    )
    speed: float = parameter(
        1.0, 'Simulated seconds per wall second with clock realtime', minimum=0.01, maximum=100.0
    )
    seed: int = parameter(
        0, 'Seed of everything random in the simulation', minimum=0, maximum=2**31 - 1
    )
    start_time_ns: int = parameter(
        0,
        'Time at which the clock starts, ns; after a restart the clock must not go back',
        minimum=0,
        maximum=2**62,
    )
    answer_timeout_s: float = parameter(
        5.0,
        'Wall seconds after which a node that does not answer in lockstep is named',
        minimum=0.1,
        maximum=3600.0,
    )
    recorded: bool = parameter(
        False,
        'Whether a recorder belongs to the run: the first tick waits for it, and each in lockstep',
    )

    judged: bool = parameter(
        False,
        'Whether somebody judges the run: in lockstep it is never far ahead of who does',
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)
