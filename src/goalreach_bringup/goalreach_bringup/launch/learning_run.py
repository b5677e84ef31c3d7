"""Learning over the live graph: its start, continuation and result."""

from dataclasses import dataclass
from pathlib import Path

from numpy.random import default_rng

from goalreach_evaluation.choices import choose_policy
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError

_PATHS_DRIVEN = 'paths_driven'


@dataclass(frozen=True, kw_only=True)
class LearningRun:
    """A learning phase that may have started in an earlier run.

    The controller writes the policy file after every path, so a later run with the same file
    continues there, for whatever reason the earlier one ended.

    Attributes:
        policy: The policy at the start of the run.
        first_path: Number of the first path to be driven.
        trials: Trials of the whole phase.
        learner: Name of the learner.
    """

    policy: Policy
    first_path: int
    trials: int
    learner: str

    @classmethod
    def begin(
        cls, path: Path, arena: Arena, *, trials: int, learner: str | None = None
    ) -> 'LearningRun':
        """Return the learning phase of a policy file, or a new one written to it.

        `learner` is None for the one that the file began with.

        Raises:
            FileFormatError: The file is no policy, one of another arena or learner, or one that
                was not learned over the graph; or there is no such learner.
        """
        is_new = not path.exists()
        policy = Policy.unlearned(arena.regions) if is_new else choose_policy(path, arena)
        name = learner or policy.learner.get('name', 'paper')
        try:
            Agent(name, arena.regions, LearningConfig(), default_rng(), policy)
        except ConfigurationError as error:
            raise FileFormatError(path, str(error)) from None
        if is_new:
            write_policy(path, policy)
        driven = policy.learning.get(_PATHS_DRIVEN, None if policy.visits.any() else 0)
        if type(driven) is not int or driven < 0:
            reason = f'learning.{_PATHS_DRIVEN} = {driven!r}: must be the number of paths driven'
            raise FileFormatError(path, f'{reason}; choose a new file for --learn')
        return cls(policy=policy, first_path=driven, trials=trials, learner=name)

    def total(self, starts: int) -> int:
        """Return the number of paths of the whole learning phase."""
        return self.trials * starts

    def remaining(self, requested: int, starts: int) -> int:
        """Return the number of paths of this run: all that are left, or as many as requested."""
        left = max(0, self.total(starts) - self.first_path)
        return min(requested, left) if requested else left

    def announcement(self, starts: int) -> str:
        """Return the message at the start of learning."""
        total = self.total(starts)
        if self.first_path:
            return f'continuing with path {self.first_path + 1} of {total}'
        return f'learning over the graph: {self.trials} trials of {starts} paths'

    @staticmethod
    def verdict(path: Path, arena: Arena) -> str:
        """Return the message at the end of learning: the success of the policy in the file."""
        policy = read_policy(path)
        successes = greedy_successes(arena, policy)
        driven = policy.learning.get(_PATHS_DRIVEN, 0)
        return (
            f'{path}: after {driven} paths the best actions lead to the goal from '
            f'{sum(successes)} of {len(successes)} starts'
        )
