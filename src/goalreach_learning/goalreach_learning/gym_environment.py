"""The options of the paper as a Gymnasium environment; requires the extra `gym`.

Importing this module registers `goalreach/GoalReach-v0` with Gymnasium.
"""

from collections.abc import Mapping
from typing import Any, Final

import gymnasium
from gymnasium import spaces
import numpy as np
from numpy.typing import NDArray

from goalreach_learning.kinematic_drive import OptionEnvironment
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import PathOutcome

ENVIRONMENT_ID: Final = 'goalreach/GoalReach-v0'
OBSERVATIONS: Final = ('region', 'memberships', 'pose')

_MAX_OPTIONS = 60

Observation = NDArray[np.float32] | np.int64


class GoalReachEnv(gymnasium.Env[Any, np.int64]):
    """A robot among four walls that learns to reach a goal region.

    ## Description
    The goal-reaching task of D'Orazio, Cicirelli, Attolico and Distante: an arena of 140 x 200 in
    (3.556 x 5.080 m) is split into nine regions, three columns (LEFT-SIDE, FRONT, RIGHT-SIDE) by
    three rows (NEAR, MEDIUM, FAR). From one of 22 points at the borders the robot is to reach
    FRONT/NEAR. One step is one option: the robot turns to an absolute heading and drives straight
    until its region changes or its body touches a wall, in closed form and without noise.

    ## Action Space
    `Discrete(8)`: action k is the heading k * 45 degrees, counter-clockwise from +x. The goal wall
    is y = 0, so action 6 (270 degrees) faces it.

    ## Observation Space
    | `observation` | space | meaning |
    | --- | --- | --- |
    | `'region'` (default) | `Discrete(9)` | rows * column + row |
    | `'memberships'` | `Box(0, 1, (6,))` | degrees of the three columns, then the three rows |
    | `'pose'` | `Box(0, 1, (2,))` | x over the width and y over the length of the arena |

    The region alone is not a Markov state: the end of an option depends on where in the region it
    began. On a border, only `'region'` tells which side the robot is on.

    ## Rewards
    +1 for entering the goal region, -1 for touching a wall, 0 otherwise.

    ## Starting State
    A random one of the arena's starts. `reset(options={'start': k})` selects the k-th;
    `{'start': (x_m, y_m)}` any point of the free floor outside the goal.

    ## Episode End
    Termination: the goal is reached or a wall touched. Truncation: after 60 options, by the
    `TimeLimit` wrapper of `gymnasium.make`.

    ## Information
    `x_m`, `y_m` (metres), `region` (name), `length_m` (driven in this step) and, after a step,
    `is_success`.

    ## Arguments
    * `observation`: one of `'region'`, `'memberships'`, `'pose'`.
    * `arena`: an `Arena`; the paper's by default.
    * `overshoot_m`: distance driven past a border before an option ends, metres; 0 by default.
    * `start_jitter_m`: largest shift of starts along x and y, not into the goal, metres; or 0.

    ```python
    import gymnasium
    import goalreach_learning.gym_environment

    env = gymnasium.make('goalreach/GoalReach-v0', observation='region')
    ```
    """

    metadata: dict[str, Any] = {'render_modes': []}  # noqa: RUF012 - as the base class has it

    def __init__(
        self,
        *,
        observation: str = 'region',
        arena: Arena | None = None,
        overshoot_m: float = 0.0,
        start_jitter_m: float = 0.0,
        render_mode: str | None = None,
    ) -> None:
        if observation not in OBSERVATIONS:
            allowed = 'one of ' + ', '.join(OBSERVATIONS)
            raise ConfigurationError('observation', observation, allowed)
        if render_mode is not None:
            raise ConfigurationError('render_mode', render_mode, 'None: there is no rendering')
        self.render_mode = render_mode
        self._arena = arena or Arena()
        self._kind = observation
        self._jitter_m = start_jitter_m
        self._environment = OptionEnvironment(self._arena, overshoot_m=overshoot_m)
        self.action_space = spaces.Discrete(self._arena.regions.actions)
        self.observation_space = _space(observation, self._arena.regions.shape)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Place the robot at a start.

        Args:
            seed: Seed of the starts, or None to continue the sequence.
            options: `start` as an index or a point (x_m, y_m), metres.

        Raises:
            ConfigurationError: There is no such start.
        """
        super().reset(seed=seed)
        start = (options or {}).get('start')
        if start is None:
            start = int(self.np_random.integers(len(self._arena.starts)))
        self._x_m, self._y_m = self._point(start)
        self._region = self._arena.regions.region_at(self._x_m, self._y_m)
        return self._observe(), self._info(0.0)

    def _point(self, start: object) -> tuple[float, float]:
        """Return the point of a start given by index or position."""
        starts, regions = self._arena.starts, self._arena.regions
        if isinstance(start, (int, np.integer)):
            if not 0 <= start < len(starts):
                raise ConfigurationError('start', start, f'an index below {len(starts)}')
            one, jitter_m = starts[int(start)], self._jitter_m
            dx_m, dy_m = self.np_random.uniform(-jitter_m, jitter_m, 2).tolist()
            at_m = self._environment.clamp(one.x_m + dx_m, one.y_m + dy_m)
            return (one.x_m, one.y_m) if regions.region_at(*at_m) in regions.ends else at_m
        try:
            point = np.asarray(start, dtype=np.float64)
        except (TypeError, ValueError):
            raise ConfigurationError('start', start, 'an index or x and y, metres') from None
        is_free = point.shape == (2,) and self._arena.is_free(*point)
        if not is_free or regions.region_at(*point) in regions.ends:
            raise ConfigurationError('start', start, 'a free point outside the goal')
        return float(point[0]), float(point[1])

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Execute one option.

        Args:
            action: Index of the heading.

        Returns:
            Observation, reward, whether terminated, whether truncated (always False), information.
        """
        end = self._environment.advance(self._x_m, self._y_m, self._region, int(action))
        self._x_m, self._y_m, self._region = end.x_m, end.y_m, end.region
        regions = self._arena.regions
        outcome = PathOutcome.BUMP if end.bumped else regions.ends.get(end.region)
        info = {**self._info(end.length_m), 'is_success': outcome is PathOutcome.GOAL}
        return self._observe(), regions.rewards.of(outcome), outcome is not None, False, info

    def _observe(self) -> Observation:
        regions = self._arena.regions
        if self._kind == 'region':
            return np.int64(regions.shape[1] * self._region[0] + self._region[1])
        if self._kind == 'memberships':
            mu_x, mu_y = regions.memberships_at(self._x_m, self._y_m)
            return np.array([*mu_x, *mu_y], dtype=np.float32)
        share = (self._x_m / self._arena.width_m, self._y_m / self._arena.length_m)
        return np.array(share, dtype=np.float32)

    def _info(self, length_m: float) -> dict[str, Any]:
        return {
            'x_m': self._x_m,
            'y_m': self._y_m,
            'region': self._arena.regions.name(self._region),
            'length_m': length_m,
        }


def _space(observation: str, shape: tuple[int, int]) -> spaces.Space[Any]:
    if observation == 'region':
        return spaces.Discrete(shape[0] * shape[1])
    size = sum(shape) if observation == 'memberships' else 2
    return spaces.Box(0.0, 1.0, (size,), np.float32)


gymnasium.register(
    ENVIRONMENT_ID, entry_point=f'{__name__}:GoalReachEnv', max_episode_steps=_MAX_OPTIONS
)
