"""A `nomad200` node in a process of its own, and a test that plays the rest of its graph."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
import subprocess
import sys
from typing import Any

from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan
from std_srvs.srv import SetBool, Trigger

from goalreach_msgs_py.pose_messages import odometry_from_raw, twist_to_raw
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, stamp_from_msg
from goalreach_msgs_py.sensor_messages import head_to_raw
from goalreach_msgs_py.values import HeadAngles, Pose2, Twist2
import graphs

LIMIT_S = 90.0
END_S = 10.0
MODULES = {
    'nomad200': 'goalreach_sim.nomad200_node',
    'landmark_localizer': 'goalreach_perception.landmark_localizer_node',
    'state_estimator': 'goalreach_perception.state_estimator_node',
    'goal_reaching_controller': 'goalreach_learning.goal_reaching_controller_node',
}


@contextmanager
def node_process(
    name: str,
    parameters: Mapping[str, object],
    *,
    domain: int,
    home: Path,
    remaps: Sequence[str] = (),
) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """Run one of the nodes; give its process and the file that takes what it says."""
    log_path = home / f'{name}.txt'
    overrides = [part for key, value in parameters.items() for part in ('-p', f'{key}:={value}')]
    overrides += [part for remap in remaps for part in ('-r', remap)]
    with log_path.open('w') as log:
        process = subprocess.Popen(
            [sys.executable, '-m', MODULES[name], '--ros-args', *overrides],
            env={**graphs.graph_environment(domain, home), 'PYTHONUNBUFFERED': '1'},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            text=True,
        )
    try:
        yield process, log_path
    finally:
        process.terminate()
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@dataclass
class RobotGraph:
    """The running robot as a test sees it.

    Attributes:
        node: The test's own node.
        serve_until: Serves it until a condition holds; returns whether it did in the time.
        log_path: What the robot's process said.
        speaks: Whether the test commands the robot; otherwise it only looks on.
    """

    node: Node
    serve_until: Callable[[Callable[[], bool], float], bool]
    log_path: Path
    speaks: bool = True
    clock_ns: list[int] = field(default_factory=list)
    truth: list[Odometry] = field(default_factory=list)
    scans: list[LaserScan] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._drive: Any = None
        subscribe = self.node.create_subscription
        subscribe(Odometry, '/ground_truth/odom', self.truth.append, RELIABLE_QOS)
        subscribe(LaserScan, '/bumpers', self.scans.append, RELIABLE_QOS)
        subscribe(
            Clock, '/clock', lambda m: self.clock_ns.append(stamp_from_msg(m.clock)), RELIABLE_QOS
        )
        if not self.speaks:
            return
        self.drive_by('/cmd_vel')
        self._head = self.node.create_publisher(JointState, '/head/command', RELIABLE_QOS)
        self._parameters = AsyncParameterClient(self.node, 'nomad200')

    def drive_by(self, topic: str) -> None:
        """Send the commands of `drive` on a topic."""
        if self._drive is not None:
            self.node.destroy_publisher(self._drive)
        self._drive = self.node.create_publisher(TwistStamped, topic, RELIABLE_QOS)

    @property
    def log(self) -> str:
        return self.log_path.read_text()

    @property
    def pose(self) -> Pose2:
        return odometry_from_raw(serialize_message(self.truth[-1])).pose

    @property
    def speed_m_per_s(self) -> float:
        return odometry_from_raw(serialize_message(self.truth[-1])).twist.linear_m_per_s

    def wait(self, condition: Callable[[], bool], limit_s: float = LIMIT_S) -> None:
        assert self.serve_until(condition, limit_s), self.log

    def wait_for_ticks(self, count: int) -> None:
        """Wait until `count` more ticks were heard whole: the truth, the bumpers and the clock."""
        target = len(self.truth) + count

        def heard() -> bool:
            if len(self.truth) < target:
                return False
            tick_ns = stamp_from_msg(self.truth[target - 1].header.stamp)
            scan_ns = stamp_from_msg(self.scans[-1].header.stamp) if self.scans else -1
            return min(scan_ns, self.clock_ns[-1] if self.clock_ns else -1) >= tick_ns

        self.wait(heard)

    def drive(self, linear_m_per_s: float, steering_rad_per_s: float, stamp_ns: int) -> None:
        twist = Twist2(linear_m_per_s=linear_m_per_s, steering_rad_per_s=steering_rad_per_s)
        self._drive.publish(twist_to_raw(twist, stamp_ns))

    def turn_head(self, stamp_ns: int, pan_rad: float = 0.0) -> None:
        head = HeadAngles(turret_rad=0.0, pan_rad=pan_rad, tilt_rad=0.0)
        self._head.publish(head_to_raw(head, stamp_ns))

    def call(self, service_type: Any, name: str, request: Any) -> Any:
        client = self.node.create_client(service_type, name)
        self.wait(client.service_is_ready)
        return self._result(client.call_async(request))

    def reset(self) -> Any:
        return self.call(Trigger, '/nomad200/reset', Trigger.Request())

    def pause(self, *, on: bool) -> Any:
        return self.call(SetBool, '/nomad200/pause', SetBool.Request(data=on))

    def step(self) -> Any:
        return self.call(Trigger, '/nomad200/step', Trigger.Request())

    def set_parameter(self, name: str, value: object) -> SetParametersResult:
        self.wait(self._parameters.services_are_ready)
        result = self._result(self._parameters.set_parameters([Parameter(name, value=value)]))
        return result.results[0]

    def _result(self, future: Any) -> Any:
        self.wait(future.done)
        return future.result()


@contextmanager
def robot_graph(
    home: Path, remaps: Sequence[str] = (), /, **parameters: object
) -> Iterator[RobotGraph]:
    """Run the robot with parameters, in a domain of its own; wait until it is up."""
    domain = graphs.fresh_domain()
    with (
        graphs.onlooker(domain) as (node, serve_until),
        node_process('nomad200', parameters, domain=domain, home=home, remaps=remaps) as (
            _,
            log_path,
        ),
    ):
        graph = RobotGraph(node, serve_until, log_path)
        graph.wait(lambda: 'nomad200' in node.get_node_names())
        yield graph
