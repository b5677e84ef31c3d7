"""Q-learning, policies and the goal-reaching controller.

Start with `train`, which learns a `Policy` in an arena. `GoalReachingController` drives it, with
`blend_heading` for fuzzy states. `goalreach_learning.gym_environment`, which needs the extra
`gym`, offers the same task to other learners.
"""

from typing import TYPE_CHECKING

from goalreach_msgs_py.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from goalreach_learning.blending import MODES as MODES
    from goalreach_learning.blending import blend_heading as blend_heading
    from goalreach_learning.controller import ControlStep as ControlStep
    from goalreach_learning.controller import GoalReachingController as GoalReachingController
    from goalreach_learning.controller_config import ControllerConfig as ControllerConfig
    from goalreach_learning.environment import OptionEnd as OptionEnd
    from goalreach_learning.environment import OptionEnvironment as OptionEnvironment
    from goalreach_learning.kinematic_drive import Track as Track
    from goalreach_learning.kinematic_drive import blended_track as blended_track
    from goalreach_learning.kinematic_drive import crisp_track as crisp_track
    from goalreach_learning.kinematic_drive import greedy_successes as greedy_successes
    from goalreach_learning.policy import Policy as Policy
    from goalreach_learning.policy_file import read_policy as read_policy
    from goalreach_learning.policy_file import write_policy as write_policy
    from goalreach_learning.q_learning import LearningConfig as LearningConfig
    from goalreach_learning.q_learning import QLearner as QLearner
    from goalreach_learning.q_learning import boltzmann_probabilities as boltzmann_probabilities
    from goalreach_learning.q_learning import q_update as q_update
    from goalreach_learning.q_learning import select_action as select_action
    from goalreach_learning.training import TrainingResult as TrainingResult
    from goalreach_learning.training import train as train

__all__, __getattr__, __dir__ = lazy_exports(__name__)
