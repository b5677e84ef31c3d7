"""The learning phase of many seeds at once, for statistics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from goalreach_lab.batch.batch_environment import BatchEnd, BatchEnvironment, IntArray
from goalreach_learning.environment import OptionEnvironment
from goalreach_learning.policy import best_actions, tie_tolerance
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.task import BUMP_REWARD, GOAL_REWARD
from goalreach_learning.training import MAX_GREEDY_OPTIONS
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import FloatArray

_ACTIONS = 8
GOAL_END, BUMP_END = 9, 10
_ENDS = 11


@dataclass(frozen=True, kw_only=True, eq=False)
class BatchResult:
    """What n learning phases yield.

    Attributes:
        q_by_trial: Q-values after each trial, (n, trials, 3, 3, 8).
        visits_by_trial: Updates so far after each trial, same shape.
        success_by_trial: Share of the exploring paths that reached the goal, (n, trials).
        counts: How often each action led where, all phases together, (3, 3, 8, 11): the last
            axis is the region 3 * i + j, then `GOAL_END` and `BUMP_END`.
    """

    q_by_trial: FloatArray
    visits_by_trial: IntArray
    success_by_trial: FloatArray
    counts: IntArray


class _Lanes:
    """n learners side by side, each in its own path; the slow ones hold up no other."""

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
        self.goals = np.zeros((n, config.trials), dtype=np.int64)
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

    def place(self, lanes: IntArray) -> None:
        """Put lanes at the starts of their paths; one placed in the goal has reached it."""
        while len(lanes):
            start = self.path[lanes] % len(self.starts_m)
            point = self.starts_m[start]
            if self.config.start_jitter_m > 0.0:
                uniform = self.rng.random((len(lanes), 2))
                point = point + (2.0 * uniform - 1.0) * self.config.start_jitter_m
                point = np.clip(point, self.low_m, self.high_m)
            self.x_m[lanes], self.y_m[lanes] = point.T
            self.i[lanes], self.j[lanes] = self.batch.regions_at(*point.T)
            self.options[lanes] = 0
            done = (self.i[lanes] == self.goal[0]) & (self.j[lanes] == self.goal[1])
            lanes = self.finish(lanes[done], np.ones(int(done.sum()), dtype=np.bool_))

    def finish(self, lanes: IntArray, reached: NDArray[np.bool_]) -> IntArray:
        """Count finished paths, keep what a finished trial has learned, return who goes on."""
        count = len(self.starts_m)
        trial = self.path[lanes] // count
        np.add.at(self.goals, (lanes, trial), reached)
        self.path[lanes] += 1
        last = self.path[lanes] % count == 0
        self.q_by_trial[lanes[last], trial[last]] = self.q[lanes[last]]
        self.visits_by_trial[lanes[last], trial[last]] = self.visits[lanes[last]]
        return lanes[self.path[lanes] < self.paths]

    def step(self, lanes: IntArray) -> IntArray:
        """Take one action in every lane, learn from it, and return the lanes that go on."""
        i, j = self.i[lanes], self.j[lanes]
        action = self.choose(lanes, i, j)
        end = self.batch.advance(self.x_m[lanes], self.y_m[lanes], i, j, action)
        reached = ~end.bumped & (end.i == self.goal[0]) & (end.j == self.goal[1])
        self.learn((lanes, i, j, action), end, reached)
        self.x_m[lanes], self.y_m[lanes] = end.x_m, end.y_m
        self.i[lanes], self.j[lanes] = end.i, end.j
        self.options[lanes] += 1
        ended = reached | end.bumped | (self.options[lanes] >= self.config.max_options)
        self.place(self.finish(lanes[ended], reached[ended]))
        return lanes[self.path[lanes] < self.paths]

    def choose(self, lanes: IntArray, i: IntArray, j: IntArray) -> IntArray:
        """Choose as `select_action` does, in every lane."""
        q = self.q[lanes, i, j]
        trial = self.path[lanes] // len(self.starts_m)
        scaled = (q - q.max(axis=1, keepdims=True)) / self.temperatures[trial][:, np.newaxis]
        cumulative = np.exp(scaled).cumsum(axis=1)
        uniform = self.rng.random(len(lanes))[:, np.newaxis]
        chosen = (uniform * cumulative[:, -1:] >= cumulative).sum(axis=1)
        visited = self.visits[lanes, i, j].any(axis=1)
        return np.where(visited, chosen, (uniform[:, 0] * _ACTIONS).astype(np.int64))

    def learn(
        self,
        at: tuple[IntArray, IntArray, IntArray, IntArray],
        end: BatchEnd,
        reached: NDArray[np.bool_],
    ) -> None:
        """Apply equation (1), as `q_update` does, in every lane."""
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
    """Run n learning phases that differ in their chance alone.

    The same procedure as `train`; with n = 1 and the same generator, the same numbers.

    Args:
        arena: Walls, regions and starts.
        config: The free parameters.
        rng: Source of all chance.
        n: Number of learning phases.
    """
    lanes = _Lanes(arena, config, rng, n)
    running: IntArray = np.arange(n)
    running = running[lanes.path < lanes.paths]
    while len(running):
        running = lanes.step(running)
    return BatchResult(
        q_by_trial=lanes.q_by_trial,
        visits_by_trial=lanes.visits_by_trial,
        success_by_trial=lanes.goals / len(arena.starts),
        counts=lanes.counts,
    )


def greedy_successes_batch(
    arena: Arena, q: FloatArray, visits: IntArray, *, gamma: float, overshoot_m: float = 0.0
) -> NDArray[np.bool_]:
    """Return whether the best actions of n Q-tables lead from each start to the goal.

    Args:
        arena: Walls, regions and starts.
        q: Q-values (n, 3, 3, 8).
        visits: How often each was updated, same shape.
        gamma: Discount factor that the tables were learned with.
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
    lanes = np.flatnonzero(~reached)
    x_m, y_m, i, j = x_m[lanes], y_m[lanes], i[lanes], j[lanes]
    for _ in range(MAX_GREEDY_OPTIONS):
        action = best[table[lanes], i, j]
        end = batch.advance(x_m, y_m, i, j, np.maximum(action, 0))
        entered = ~end.bumped & (end.i == goal[0]) & (end.j == goal[1]) & (action >= 0)
        reached[lanes[entered]] = True
        goes_on = ~(entered | end.bumped | (action < 0))
        lanes = lanes[goes_on]
        x_m, y_m, i, j = end.x_m[goes_on], end.y_m[goes_on], end.i[goes_on], end.j[goes_on]
        if not len(lanes):
            break
    by_table: NDArray[np.bool_] = reached.reshape(len(q), count)
    return by_table
