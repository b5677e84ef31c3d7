"""Learners: what they are given, what they must do, and how they are found by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from pkgutil import resolve_name
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.parameters import flatten_config
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import FloatArray, PathOutcome, Region

LEARNERS: Final = {
    'paper': 'goalreach_learning.learners.tabular:PaperLearner',
    'planner': 'goalreach_learning.learners.planner:PlanningLearner',
    'q-lambda': 'goalreach_learning.learners.tabular:QLambdaLearner',
    'dyna-q': 'goalreach_learning.learners.tabular:DynaQLearner',
}
"""The project's own learners; packages offer theirs as entry points `goalreach.learners`."""


class LearnerSetup(NamedTuple):
    """What a learner is told before it starts: neither walls, nor borders, nor the goal.

    Attributes:
        shape: Numbers of columns, rows and actions; action k is the heading k * 2 pi / count.
        config: Learning rate, discount and temperatures.
        rng: Source of its random choices.
    """

    shape: tuple[int, ...]
    config: LearningConfig
    rng: np.random.Generator


class Situation(NamedTuple):
    """What a learner sees before and after an action.

    Attributes:
        region: The state (i, j).
        x_m: Estimated position in `map`, metres.
        y_m: Estimated position in `map`, metres.
        trial: Number of the trial, from 0.
        path: Number of the path, from 0.
        certain: Whether the covariance of the estimate is small enough to rely on it.
    """

    region: Region
    x_m: float
    y_m: float
    trial: int = 0
    path: int = 0
    certain: bool = True


class Experience(NamedTuple):
    """One finished action.

    Attributes:
        before: Where it began.
        action: Its index.
        reward: Its reward.
        after: Where it ended.
        outcome: How the path ended with it, or None. A time-out is not reported.
        touched_rad: Azimuths in `map` of what the bumpers touch, radians; empty without a bump, or
            where the orientation of the base is unknown.
    """

    before: Situation
    action: int
    reward: float
    after: Situation
    outcome: PathOutcome | None = None
    touched_rad: tuple[float, ...] = ()


class Learner(Protocol):
    """What learns in `train`, `run --learn` and `sweep`: a class made from a `LearnerSetup`."""

    def choose(self, situation: Situation) -> int:
        """Return the index of the action to try."""

    def update(self, experience: Experience) -> None:
        """Learn from a finished action."""

    def policy(self) -> tuple[FloatArray, NDArray[np.int64]]:
        """Return Q-values and visits, both of the setup's shape; unvisited is never greedy."""

    def save(self) -> Mapping[str, Any]:
        """Return what it needs to continue besides Q-values and visits, as JSON can hold it."""

    def load(self, state: Mapping[str, Any]) -> None:
        """Continue from what `save` returned, with `q` and `visits` added as nested lists."""


@dataclass
class Agent:
    """A learner with the regions it acts in, and its answers checked.

    Attributes:
        name: A name of `LEARNERS`, an entry point `goalreach.learners`, or module:Class.
        regions: The regions, of which the learner is told the numbers alone.
        known: Policy to continue from; None, or one without visits, to begin.

    Raises:
        ConfigurationError: There is no such learner, it fails, or a method is missing; or the
            policy holds the state of another learner, or a damaged one.
    """

    name: str
    regions: RegionMap
    config: LearningConfig
    rng: np.random.Generator
    known: Policy | None = None

    def __post_init__(self) -> None:
        shape = (*self.regions.shape, self.regions.actions)
        try:
            make = _factory(self.name)
            self.learner = make(LearnerSetup(shape=shape, config=self.config, rng=self.rng))
        except GoalreachError:
            raise
        except Exception as error:  # noqa: BLE001 - a class of the user's may raise anything
            raise ConfigurationError('learner', self.name, f'a learner: {error!r}') from None
        for method in ('choose', 'update', 'policy', 'save', 'load'):
            if not callable(getattr(self.learner, method, None)):
                raise ConfigurationError('learner', self.name, f'a learner: {method}() is missing')
        if self.known and (self.known.learner or self.known.visits.any()):
            self._continue(self.known)

    def _continue(self, policy: Policy) -> None:
        known = {'name': 'paper', 'state': {}, **policy.learner}
        if known['name'] != self.name:
            allowed = f'{known["name"]}, which the policy began with'
            raise ConfigurationError('learner', self.name, allowed)
        table = {'q': policy.q.tolist(), 'visits': policy.visits.tolist()}
        try:
            self.learner.load({**known['state'], **table})
        except (KeyError, TypeError, ValueError, IndexError) as error:
            allowed = f'readable: {error!r}'
            raise ConfigurationError('learner.state', known['state'], allowed) from None

    def choose(self, situation: Situation) -> int:
        """Return the action that the learner chooses.

        Raises:
            ConfigurationError: It is no index of an action.
        """
        action, count = self.learner.choose(situation), self.regions.actions
        if not isinstance(action, (int, np.integer)) or not 0 <= action < count:
            raise ConfigurationError('choose()', action, f'an index in 0..{count - 1}')
        return int(action)

    @property
    def policy(self) -> Policy:
        """What has been learned, with what the learner needs to continue.

        Raises:
            ConfigurationError: Q-values or visits have the wrong shape, or are not finite.
        """
        q, visits = self.learner.policy()
        state, learning = self.learner.save(), flatten_config(self.config)
        own = {} if self.name == 'paper' else {'name': self.name, 'state': dict(state)}
        q, visits = np.array(q), np.array(visits)  # a policy freezes its own
        return Policy(q=q, visits=visits, regions=self.regions, learning=learning, learner=own)


def _factory(name: str) -> Callable[[LearnerSetup], Learner]:
    """Return the class of a learner."""
    reference = LEARNERS.get(name, name)
    if ':' not in reference:
        offered = {point.name: point.value for point in entry_points(group='goalreach.learners')}
        if name not in offered:
            known = ', '.join((*LEARNERS, *offered))
            raise ConfigurationError('learner', name, f'one of {known}, or module:Class')
        reference = offered[name]
    found: Callable[[LearnerSetup], Learner] = resolve_name(reference)
    return found
