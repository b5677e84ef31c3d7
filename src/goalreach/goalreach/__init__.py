"""A robot that learns to reach a goal it sees, in ten lines and without ROS.

Learn a policy, drive it through rendered camera images, look at every frame, draw the figures:

>>> import goalreach
>>> policy = goalreach.train(seed=7)
>>> result = goalreach.evaluate(policy, starts='random:2', seed=7)
>>> result.success_rate
1.0
>>> for frame in goalreach.simulate(policy, start=(1.2, 4.5, 90.0)):
...     outcome = frame.result and frame.result.outcome
>>> outcome
'goal'

If Gymnasium is installed (the extra `gym`), importing this package registers the environment:

>>> import gymnasium
>>> gymnasium.make('goalreach/GoalReach-v0').action_space
Discrete(8)

The packages below this one (`goalreach_learning`, `goalreach_perception`, ...) hold the parts, for
those who want to replace one.
"""

from importlib import import_module
from importlib.util import find_spec

from goalreach.api import evaluate, figures, simulate, train
from goalreach_evaluation.drive import DriveFrame
from goalreach_evaluation.evaluation import Evaluation
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Pose2

__all__ = [
    'Arena', 'DriveFrame', 'Evaluation', 'GoalreachError', 'LearningConfig', 'NoiseModel',
    'Policy', 'Pose2', 'evaluate', 'figures', 'read_arena', 'read_policy', 'simulate', 'train',
    'write_policy',
]  # fmt: skip

if find_spec('gymnasium') is not None:
    import_module('goalreach_learning.gym_environment')
