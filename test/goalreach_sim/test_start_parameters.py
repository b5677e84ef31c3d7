"""What parameters given at the start make of the robot's node, without a graph."""

from collections.abc import Iterator
from contextlib import contextmanager

import rclpy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import LaserScan

from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
from goalreach_sim.nomad200_node import Nomad200Node
from graphs import fresh_domain


class Publisher:
    """Keeps what a node publishes."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def publish(self, message: bytes) -> None:
        self.sent.append(message)


@contextmanager
def robot_with(**parameters: object) -> Iterator[Nomad200Node]:
    words = [w for name, value in parameters.items() for w in ('-p', f'{name}:={value}')]
    use_profile(fast_dds_profile())
    rclpy.init(args=['--ros-args', *words], domain_id=fresh_domain())
    node = Nomad200Node()
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def test_a_fault_given_at_the_start_is_there_from_the_first_tick() -> None:
    with robot_with(**{'faults.stuck_bumper': 3}) as robot:
        robot._frames._bumpers = bumpers = Publisher()
        robot._tick()
    (raw,) = bumpers.sent
    scan = deserialize_message(raw, LaserScan)
    assert [ray for ray, range_m in enumerate(scan.ranges) if range_m < 1.0] == [3]
