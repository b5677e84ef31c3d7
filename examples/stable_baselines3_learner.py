"""DQN of stable-baselines3 as a learner of the robot.

Needs stable-baselines3, which installs torch: `pip install '.[sb3]'`. Then:

    cd examples
    goalreach train --learner stable_baselines3_learner:DqnLearner --out policy.json
    goalreach run --learn --learner stable_baselines3_learner:DqnLearner --policy ./learned.json
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
import io
from typing import Any, Final

from agent_learner import AgentLearner, RobotEnvironment
import numpy as np
from stable_baselines3 import DQN
import torch

from goalreach_learning.learner import LearnerSetup

_DQN: Final[dict[str, Any]] = {
    'learning_rate': 2e-3,
    'learning_starts': 50,
    'gradient_steps': 4,
    'batch_size': 64,
    'target_update_interval': 100,
    'exploration_fraction': 6e-7,
    'policy_kwargs': {'net_arch': [64]},
}
"""Chosen by hand for some hundred actions, of `STEPS` 600 explore; the rest is default."""
STEPS: Final = 10**9


class DqnLearner(AgentLearner):
    """DQN of stable-baselines3 (`pip install '.[sb3]'`)."""

    def __init__(self, setup: LearnerSetup) -> None:
        super().__init__(setup, self._begin, self._q)
        self._agent.set_random_seed(int(setup.rng.integers(2**31)))
        self._agent.gamma = setup.config.gamma

    def _begin(self, environment: RobotEnvironment) -> Callable[[], object]:
        torch.set_num_threads(1)
        self._agent: Any = DQN('MlpPolicy', environment, device='cpu', **_DQN)
        return lambda: self._agent.learn(STEPS)

    def _q(self, number: int) -> Any:  # noqa: ANN401 - an array
        seen, _ = self._agent.policy.obs_to_tensor(np.array(number))
        return self._agent.q_net(seen).detach().numpy()[0]

    def save(self) -> Mapping[str, Any]:
        """Return the networks; what it remembers is not kept."""
        file = io.BytesIO()
        torch.save(self._agent.q_net.state_dict(), file)
        return {'network': base64.b64encode(file.getvalue()).decode('ascii')}

    def load(self, state: Mapping[str, Any]) -> None:
        """Continue with the networks, and what follows from them."""
        super().load(state)
        file = io.BytesIO(base64.b64decode(state['network']))
        for network in (self._agent.q_net, self._agent.q_net_target):
            network.load_state_dict(torch.load(file, weights_only=True))
            file.seek(0)
