"""Q-learning of many seeds at once, for statistics, and the optimal values to compare with.

The same procedures as in `goalreach_learning`, number for number, on arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_learning.environment import OptionEnvironment
from goalreach_learning.kinematic_drive import MAX_OPTIONS
from goalreach_learning.policy import best_actions, tie_tolerance
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.task import ACTION_DIRECTIONS, BUMP_REWARD, GOAL_REWARD
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import FloatArray

IntArray = NDArray[np.int64]

_DIRECTIONS = np.array(ACTION_DIRECTIONS)
_SIGNS = np.sign(_DIRECTIONS).astype(np.int64)
_DIVISORS = np.where(_SIGNS == 0, 1.0, _DIRECTIONS)
_ACTIONS = 8
GOAL_END, BUMP_END = 9, 10
_ENDS = 11
_REGIONS = 9


class BatchEnd(NamedTuple):
    """Ends of n options: `OptionEnd` with arrays (n,)."""

    x_m: FloatArray
    y_m: FloatArray
    i: IntArray
    j: IntArray
    bumped: NDArray[np.bool_]
    length_m: FloatArray


class BatchEnvironment:
    """`OptionEnvironment` for n robots at once.

    Args:
        environment: The environment of each robot.
    """

    def __init__(self, environment: OptionEnvironment) -> None:
        """Tabulate borders [region index][sign + 1] and contacts [sign + 1]."""
        self.regions = environment.regions
        self._overshoot_m = environment.overshoot_m
        x_inner, y_inner = self.regions.x_borders_m[1:3], self.regions.y_borders_m[1:3]
        self._x_inner, self._y_inner = x_inner, y_inner
        self._x_borders, self._y_borders = _border_table(x_inner), _border_table(y_inner)
        x_low, x_high = environment.x_contacts_m
        y_low, y_high = environment.y_contacts_m
        self._x_contacts = np.array([x_low, np.inf, x_high])
        self._y_contacts = np.array([y_low, np.inf, y_high])

    def advance(
        self, x_m: FloatArray, y_m: FloatArray, i: IntArray, j: IntArray, action: IntArray
    ) -> BatchEnd:
        """Return where one action of each robot ends.

        Args:
            x_m: Positions (n,) in `map`, metres.
            y_m: Positions (n,) in `map`, metres.
            i: Column of the region of each, (n,).
            j: Row of the region of each, (n,).
            action: Index of the action of each, (n,).
        """
        sign_x, sign_y = _SIGNS[action, 0], _SIGNS[action, 1]
        by_x, by_y = _DIVISORS[action, 0], _DIVISORS[action, 1]
        border_x = (self._x_borders[i, sign_x + 1] - x_m) / by_x
        border_y = (self._y_borders[j, sign_y + 1] - y_m) / by_y
        wall = np.minimum(
            (self._x_contacts[sign_x + 1] - x_m) / by_x,
            (self._y_contacts[sign_y + 1] - y_m) / by_y,
        )
        border = np.maximum(0.0, np.minimum(border_x, border_y))
        blocked = wall <= border
        i = np.where(~blocked & (border_x <= border), i + sign_x, i)
        j = np.where(~blocked & (border_y <= border), j + sign_y, j)
        goal = (i == self.regions.goal[0]) & (j == self.regions.goal[1]) & ~blocked
        overshoot_m = np.where(goal, 0.0, self._overshoot_m)
        length = np.where(blocked, np.maximum(0.0, wall), np.minimum(border + overshoot_m, wall))
        bumped = blocked | ((overshoot_m > 0.0) & (length >= wall))
        x_m = x_m + length * _DIRECTIONS[action, 0]
        y_m = y_m + length * _DIRECTIONS[action, 1]
        passed = ~blocked & (overshoot_m > 0.0)
        i = np.where(passed, _index(x_m, self._x_inner), i)
        j = np.where(passed, _index(y_m, self._y_inner), j)
        return BatchEnd(x_m, y_m, i, j, bumped, length)

    def regions_at(self, x_m: FloatArray, y_m: FloatArray) -> tuple[IntArray, IntArray]:
        """Return column and row of the region of every position, as `RegionMap.region_at`."""
        return _index(x_m, self._x_inner), _index(y_m, self._y_inner)


def _border_table(inner: tuple[float, ...]) -> FloatArray:
    first, second = inner
    return np.array([[-np.inf, np.inf, first], [first, np.inf, second], [second, np.inf, np.inf]])


def _index(value_m: FloatArray, inner: tuple[float, ...]) -> IntArray:
    return (value_m >= inner[0]).astype(np.int64) + (value_m >= inner[1])


@dataclass(frozen=True, kw_only=True, eq=False)
class BatchResult:
    """Results of n learning phases.

    Attributes:
        q_by_trial: Q-values after each trial, (n, trials, 3, 3, 8).
        visits_by_trial: Updates so far after each trial, same shape.
        counts: Number of transitions of all phases, (3, 3, 8, 11): by region, action and end,
            which is a region 3 * i + j, `GOAL_END` or `BUMP_END`.
    """

    q_by_trial: FloatArray
    visits_by_trial: IntArray
    counts: IntArray


class _Learners:
    """n independent learners, each at its own place of its learning phase."""

    def __init__(
        self, arena: Arena, config: LearningConfig, rng: np.random.Generator, n: int
    ) -> None:
        environment = OptionEnvironment(arena, overshoot_m=config.overshoot_m)
        self.config = config
        self.rng = rng
        self.batch = BatchEnvironment(environment)
        self.goal = arena.regions.goal
        self.q = np.zeros((n, 3, 3, _ACTIONS))
        self.visits = np.zeros((n, 3, 3, _ACTIONS), dtype=np.int64)
        self.q_by_trial = np.zeros((n, config.trials, 3, 3, _ACTIONS))
        self.visits_by_trial = np.zeros_like(self.q_by_trial, dtype=np.int64)
        self.counts = np.zeros((3, 3, _ACTIONS, _ENDS), dtype=np.int64)
        self.path = np.zeros(n, dtype=np.int64)
        self.options = np.zeros(n, dtype=np.int64)
        self.starts_m = np.array([[s.x_m, s.y_m] for s in arena.starts])
        self.low_m, self.high_m = np.array([environment.x_contacts_m, environment.y_contacts_m]).T
        self.x_m, self.y_m = np.zeros(n), np.zeros(n)
        self.i, self.j = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        self.temperatures = np.array([config.temperature(t) for t in range(config.trials)])
        self.place(np.arange(n))

    @property
    def paths(self) -> int:
        """Paths of a whole learning phase."""
        return self.config.trials * len(self.starts_m)

    def place(self, learners: IntArray) -> None:
        """Place learners at the starts of their paths; a start in the goal ends its path."""
        while len(learners):
            start = self.path[learners] % len(self.starts_m)
            point = self.starts_m[start]
            if self.config.start_jitter_m > 0.0:
                uniform = self.rng.random((len(learners), 2))
                point = point + (2.0 * uniform - 1.0) * self.config.start_jitter_m
                point = np.clip(point, self.low_m, self.high_m)
            self.x_m[learners], self.y_m[learners] = point.T
            self.i[learners], self.j[learners] = self.batch.regions_at(*point.T)
            self.options[learners] = 0
            done = (self.i[learners] == self.goal[0]) & (self.j[learners] == self.goal[1])
            learners = self.finish(learners[done])

    def finish(self, learners: IntArray) -> IntArray:
        """Count finished paths, store finished trials, return the learners that are not done."""
        count = len(self.starts_m)
        trial = self.path[learners] // count
        self.path[learners] += 1
        last = self.path[learners] % count == 0
        self.q_by_trial[learners[last], trial[last]] = self.q[learners[last]]
        self.visits_by_trial[learners[last], trial[last]] = self.visits[learners[last]]
        return learners[self.path[learners] < self.paths]

    def step(self, learners: IntArray) -> IntArray:
        """Take one action of every learner, learn from it, return the learners not done."""
        i, j = self.i[learners], self.j[learners]
        action = self.choose(learners, i, j)
        end = self.batch.advance(self.x_m[learners], self.y_m[learners], i, j, action)
        reached = ~end.bumped & (end.i == self.goal[0]) & (end.j == self.goal[1])
        self.learn((learners, i, j, action), end, reached)
        self.x_m[learners], self.y_m[learners] = end.x_m, end.y_m
        self.i[learners], self.j[learners] = end.i, end.j
        self.options[learners] += 1
        ended = reached | end.bumped | (self.options[learners] >= self.config.max_options)
        self.place(self.finish(learners[ended]))
        return learners[self.path[learners] < self.paths]

    def choose(self, learners: IntArray, i: IntArray, j: IntArray) -> IntArray:
        """Return the action of every learner, chosen as `select_action` does."""
        q = self.q[learners, i, j]
        trial = self.path[learners] // len(self.starts_m)
        scaled = (q - q.max(axis=1, keepdims=True)) / self.temperatures[trial][:, np.newaxis]
        cumulative = np.exp(scaled).cumsum(axis=1)
        uniform = self.rng.random(len(learners))[:, np.newaxis]
        chosen = (uniform * cumulative[:, -1:] >= cumulative).sum(axis=1)
        visited = self.visits[learners, i, j].any(axis=1)
        return np.where(visited, chosen, (uniform[:, 0] * _ACTIONS).astype(np.int64))

    def learn(
        self,
        at: tuple[IntArray, IntArray, IntArray, IntArray],
        end: BatchEnd,
        reached: NDArray[np.bool_],
    ) -> None:
        """Apply equation (1) to every learner, as `q_update` does."""
        alpha, gamma = self.config.alpha, self.config.gamma
        reward = GOAL_REWARD * reached + BUMP_REWARD * end.bumped
        future = gamma * self.q[at[0], end.i, end.j].max(axis=1)
        target = reward + np.where(reached | end.bumped, 0.0, future)
        led_to = np.where(reached, GOAL_END, np.where(end.bumped, BUMP_END, 3 * end.i + end.j))
        np.add.at(self.counts, (*at[1:], led_to), 1)
        self.q[at] = (1.0 - alpha) * self.q[at] + alpha * target
        self.visits[at] += 1


def train_batch(
    arena: Arena, config: LearningConfig, *, rng: np.random.Generator, n: int
) -> BatchResult:
    """Run n learning phases that differ only in their random numbers.

    With n = 1 and the same generator, the result is that of `train`.

    Args:
        arena: Walls, regions and starts.
        config: The free parameters.
        rng: Source of randomness.
        n: Number of learning phases.
    """
    learners = _Learners(arena, config, rng, n)
    running: IntArray = np.arange(n)
    running = running[learners.path < learners.paths]
    while len(running):
        running = learners.step(running)
    return BatchResult(
        q_by_trial=learners.q_by_trial,
        visits_by_trial=learners.visits_by_trial,
        counts=learners.counts,
    )


def greedy_successes_batch(
    arena: Arena, q: FloatArray, visits: IntArray, *, gamma: float, overshoot_m: float = 0.0
) -> NDArray[np.bool_]:
    """Return whether the greedy actions of n Q-tables reach the goal from each start.

    Args:
        arena: Walls, regions and starts.
        q: Q-values (n, 3, 3, 8).
        visits: Updates of each Q-value, same shape.
        gamma: Discount factor of the learning.
        overshoot_m: Distance driven past a border before the next action, metres.

    Returns:
        (n, starts) booleans, as `greedy_successes` for each table.
    """
    batch = BatchEnvironment(OptionEnvironment(arena, overshoot_m=overshoot_m))
    goal = arena.regions.goal
    best = best_actions(q, visits, tie_tolerance(gamma))
    count = len(arena.starts)
    table = np.repeat(np.arange(len(q)), count)
    x_m = np.tile([s.x_m for s in arena.starts], len(q))
    y_m = np.tile([s.y_m for s in arena.starts], len(q))
    i, j = batch.regions_at(x_m, y_m)
    reached = (i == goal[0]) & (j == goal[1])
    learners = np.flatnonzero(~reached)
    x_m, y_m, i, j = x_m[learners], y_m[learners], i[learners], j[learners]
    for _ in range(MAX_OPTIONS):
        action = best[table[learners], i, j]
        end = batch.advance(x_m, y_m, i, j, np.maximum(action, 0))
        entered = ~end.bumped & (end.i == goal[0]) & (end.j == goal[1]) & (action >= 0)
        reached[learners[entered]] = True
        goes_on = ~(entered | end.bumped | (action < 0))
        learners = learners[goes_on]
        x_m, y_m, i, j = end.x_m[goes_on], end.y_m[goes_on], end.i[goes_on], end.j[goes_on]
        if not len(learners):
            break
    by_table: NDArray[np.bool_] = reached.reshape(len(q), count)
    return by_table


def value_iteration(counts: IntArray, *, gamma: float, tolerance: float = 1e-12) -> FloatArray:
    """Return the optimal Q-values of the decision process with given transition frequencies.

    The nine regions are not a Markov state: the end of an action depends on where in the region
    it began. The frequencies average over that, as the learner does.

    Args:
        counts: Number of transitions, (3, 3, 8, 11), as `BatchResult.counts`.
        gamma: Discount factor, below 1.
        tolerance: Largest change of a value in the last iteration.

    Returns:
        (3, 3, 8); zero where an action was never tried.
    """
    total = counts.sum(axis=-1, keepdims=True)
    share = counts / np.maximum(total, 1)
    reward = GOAL_REWARD * share[..., GOAL_END] + BUMP_REWARD * share[..., BUMP_END]
    tried = total[..., 0] > 0
    q = np.zeros(reward.shape)
    while True:
        best = np.where(tried, q, -np.inf).max(axis=-1)
        values = np.where(np.isfinite(best), best, 0.0).reshape(_REGIONS)
        update = reward + gamma * (share[..., :_REGIONS] @ values)
        if np.abs(update - q).max() <= tolerance:
            return np.asarray(update)
        q = update
