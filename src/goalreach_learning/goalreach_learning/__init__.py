"""Q-learning, policies and the goal-reaching controller.

Start with `train`, which learns a `Policy` in an arena. `GoalReachingController` drives it, with
`blend_heading` for fuzzy states. `goalreach_learning.gym_environment`, which needs the extra
`gym`, offers the same task to other learners.
"""

from goalreach_learning.blending import MODES, blend_heading
from goalreach_learning.controller import ControlStep, GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.environment import OptionEnd, OptionEnvironment
from goalreach_learning.kinematic_drive import Track, blended_track, crisp_track, greedy_successes
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.q_learning import (
    LearningConfig,
    QLearner,
    boltzmann_probabilities,
    q_update,
    select_action,
)
from goalreach_learning.training import TrainingResult, train

__all__ = [
    'MODES',
    'ControlStep',
    'ControllerConfig',
    'GoalReachingController',
    'LearningConfig',
    'OptionEnd',
    'OptionEnvironment',
    'Policy',
    'QLearner',
    'Track',
    'TrainingResult',
    'blend_heading',
    'blended_track',
    'boltzmann_probabilities',
    'crisp_track',
    'greedy_successes',
    'q_update',
    'read_policy',
    'select_action',
    'train',
    'write_policy',
]
