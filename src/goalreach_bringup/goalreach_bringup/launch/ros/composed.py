"""All four nodes in one process, on one executor."""

from __future__ import annotations

from goalreach_learning.goal_reaching_controller_node import GoalReachingControllerNode
from goalreach_msgs_py.ros.node import run_nodes
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_perception.state_estimator_node import StateEstimatorNode
from goalreach_sim.nomad200_node import Nomad200Node

_CLASSES = (
    Nomad200Node,
    LandmarkLocalizerNode,
    StateEstimatorNode,
    GoalReachingControllerNode,
)


def main() -> None:
    """Run the nodes until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes('composed', _CLASSES))


if __name__ == '__main__':
    main()
