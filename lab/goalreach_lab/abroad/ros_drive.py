"""Drives paths in the MuJoCo world: starts it and the other nodes, and judges by its truth."""

from collections.abc import Iterator, Sequence
import math
from pathlib import Path
import time
from typing import Any, Final

from geometry_msgs.msg import PoseWithCovarianceStamped
import rclpy

from goalreach_bringup.launch.options import RunOptions
from goalreach_bringup.launch.plan import plan_parameters
from goalreach_bringup.launch.ros.monitor import RunMonitor
from goalreach_evaluation.starts import RunSeeds
from goalreach_lab.localization.frame_log import pose_error, pose_nees
from goalreach_lab.rigs.graph_test_rig import GraphTestRig
from goalreach_learning.policy_file import find_policy, read_policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.diagnostic_messages import state_from_raw
from goalreach_msgs_py.inputs import StampSynchronizer
from goalreach_msgs_py.parameter_file import NodeParameters, merge_parameters, write_parameters
from goalreach_msgs_py.pose_messages import estimate_from_raw, odometry_from_raw
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
from goalreach_msgs_py.ros.messaging import DEEP_QOS, subscribe_raw
from goalreach_msgs_py.topics import GROUND_TRUTH, POSE, STATE
from goalreach_msgs_py.values import Confidence, Pose2

WORLD: Final = Path(__file__).parents[3] / 'examples' / 'mujoco_world' / 'mujoco_world.py'
_NODES: Final = (
    'goalreach_perception.landmark_localizer_node',
    'goalreach_perception.state_estimator_node',
    'goalreach_learning.goal_reaching_controller_node',
)
_SILENCE_S: Final = 30.0
"""Wall time without a tick after which none is expected any more. Chosen."""


class _Monitor(RunMonitor):
    """Also compares each certain pose with the covariance: (error in m, NEES) by tick."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.errors: list[tuple[float, float]] = []
        self.ticked_s = time.monotonic()
        self._poses = StampSynchronizer([GROUND_TRUTH, STATE, POSE], depth=200)
        subscribe_raw(self, PoseWithCovarianceStamped, POSE, self._on_pose, DEEP_QOS)

    def _on_pose(self, stamp_ns: int, raw: bytes) -> None:
        self._compare(self._poses.add(POSE, stamp_ns, raw))

    def _on_tick(self, stamp_ns: int, truth: bytes, raw_state: bytes) -> None:
        self._poses.add(GROUND_TRUTH, stamp_ns, truth)
        self._compare(self._poses.add(STATE, stamp_ns, raw_state))
        super()._on_tick(stamp_ns, truth, raw_state)

    def _compare(self, inputs: Any) -> None:
        self.ticked_s = time.monotonic()
        if inputs and state_from_raw(inputs[STATE]).confidence is Confidence.OK:
            truth = odometry_from_raw(inputs[GROUND_TRUTH]).pose
            estimate = estimate_from_raw(inputs[POSE])
            error_m = math.hypot(*pose_error(estimate.pose, truth)[:2])
            self.errors.append((round(error_m, 5), round(pose_nees(estimate, truth), 3)))


def drive(
    world: Sequence[str], told: NodeParameters, starts: Sequence[Pose2], *, seed: int
) -> Iterator[dict[str, Any]]:
    """Drive from some starts in turn; yield each path's `PathResult` and `errors` when it ends.

    Where no tick comes any more, the remaining paths have the outcome `silent`.

    Args:
        world: Options of the world.
        told: Parameters of the nodes, beyond the defaults.
        starts: The starts.
        seed: Seed of the world's errors of construction.
    """
    done: list[dict[str, Any]] = []
    use_profile(fast_dds_profile())
    with GraphTestRig.open() as rig, rig.run(_commands(world, told, starts, seed, rig.folder)):
        rclpy.init(args=[], domain_id=rig.domain)
        try:
            monitor: _Monitor = _Monitor(
                starts=starts,
                policy=read_policy('paper'),
                mode='fuzzy',
                on_path=lambda path: done.append({**path.to_json(), 'errors': monitor.errors}),
            )
            for number in range(len(starts)):
                while not done[number:] and time.monotonic() - monitor.ticked_s < _SILENCE_S:
                    rclpy.spin_once(monitor, timeout_sec=0.1)
                yield done[number] if done[number:] else {'outcome': 'silent', 'errors': []}
                monitor.errors = []
        finally:
            rclpy.try_shutdown()


def _commands(
    world: Sequence[str], told: NodeParameters, starts: Sequence[Pose2], seed: int, folder: Path
) -> list[tuple[str, ...]]:
    """Return the Python command line of each node; write its parameters."""
    options = RunOptions(seed=seed, clock='lockstep', start_poses=tuple(starts), paths=len(starts))
    seeds, policy, path = RunSeeds.spawn(seed), str(find_policy('paper')), folder / 'nodes.yaml'
    planned = plan_parameters(
        options, arena=Arena(), starts=starts, policy_path=policy, seeds=seeds, user={}
    )
    write_parameters(path, merge_parameters(planned, told))
    ours = [('-m', module, '--ros-args', '--params-file', str(path)) for module in _NODES]
    return [(str(WORLD), '--lockstep', '--seed', str(seed), *world), *ours]
