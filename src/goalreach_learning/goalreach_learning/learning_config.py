"""The free parameters of learning: the paper names them and gives no values but the trials."""

from __future__ import annotations

from dataclasses import dataclass

from goalreach_msgs_py.parameters import check_fields, parameter

__all__ = ['LearningConfig']


@dataclass(frozen=True, kw_only=True)
class LearningConfig:
    """How the learner learns.

    The paper fixes 20 trials of 22 paths; everything else here is chosen.

    Raises:
        ConfigurationError: A value is out of its range; the field is named.
    """

    alpha: float = parameter(
        0.3,
        'Learning rate of equation (1); chosen, the paper gives none',
        minimum=0.0,
        maximum=1.0,
    )
    gamma: float = parameter(
        0.9,
        'Discount factor of equation (1); chosen, the paper gives none',
        minimum=0.0,
        maximum=0.999,
    )
    temperature_start: float = parameter(
        1.0,
        'Boltzmann temperature of equation (2) in the first trial, in units of reward; chosen',
        minimum=1e-3,
        maximum=1e3,
    )
    temperature_end: float = parameter(
        0.01,
        'Boltzmann temperature of equation (2) in the last trial, in units of reward; chosen: '
        'with 0.05 the same is learned with four tenths more actions',
        minimum=1e-3,
        maximum=1e3,
    )
    trials: int = parameter(
        20,
        'Trials, each with one path from every start (20 in section "The Simulation Phase")',
        minimum=1,
        maximum=100_000,
    )
    max_options: int = parameter(
        60,
        'Actions after which a path in simulation is cut off, without penalty; chosen',
        minimum=1,
        maximum=100_000,
    )
    start_jitter_m: float = parameter(
        0.05,
        'Starts are moved by up to this much along x and y, m, so that what is learned holds '
        'near them too; 0 gives the exact starts; chosen',
        minimum=0.0,
        maximum=0.5,
    )
    overshoot_m: float = parameter(
        0.05,
        'Distance driven past a region border before the next action, m: a robot notices the '
        'border only once across; chosen',
        minimum=0.0,
        maximum=0.5,
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)

    def temperature(self, trial: int) -> float:
        """Return the temperature of a trial: geometric from start to end, then constant.

        "Tuning opportunely the temperature parameter from higher to lower value" (section "The
        Action Set and Q-learning"); the shape is chosen.

        Args:
            trial: Trial, from 0.
        """
        fraction = min(1.0, trial / max(1, self.trials - 1))
        ratio = self.temperature_end / self.temperature_start
        return float(self.temperature_start * ratio**fraction)
