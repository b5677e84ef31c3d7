"""Feeds recorded sensors to live perception, one stamp after the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import time
from typing import Any, Final

from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from goalreach_bringup.bags.bag_reader_file import BagReader
from goalreach_bringup.bags.raw_message import stamp_of
from goalreach_bringup.bags.recomputation import OUTPUTS, SENSORS
from goalreach_bringup.bags.ros_endpoints import publisher_profile
from goalreach_bringup.ros2cli.interface_types import message_class
from goalreach_msgs_py.errors import GoalreachError

__all__ = ['Feeder']

_CONNECT_S: Final = 10.0
_REPEAT_S: Final = 1.0
_ANSWER_S: Final = 20.0
"""Chosen: a lost image is sent again; a node that is silent so long does not answer at all."""

_DEEP_QOS: Final = QoSProfile(depth=100)


class Feeder(Node):
    """Publishes the sensors of a stamp and waits until all of perception has answered.

    Args:
        bag: The bag, for the types of the topics.
        executor: Serves this node and those of perception.
    """

    def __init__(self, bag: BagReader, executor: EventsExecutor) -> None:
        super().__init__('feeder', start_parameter_services=False, enable_rosout=False)
        self._executor = executor
        self._answers: dict[str, bytes] = {}
        self._stamp_ns = -1
        self._outlets: dict[str, Any] = {}
        self._inlets: list[Any] = []
        for name in SENSORS:
            topic = bag.topics[name]
            profile = publisher_profile(topic.offers)
            kind = message_class(topic.type_name)
            self._outlets[name] = self.create_publisher(kind, name, profile)
        for name in OUTPUTS:
            kind = message_class(bag.topics[name].type_name)
            self._inlets.append(
                self.create_subscription(kind, name, self._collector(name), _DEEP_QOS, raw=True)
            )

    def connect(self, deaf: tuple[str, ...]) -> None:
        """Wait until perception is connected.

        Args:
            deaf: Sensors that nobody needs to hear.

        Raises:
            GoalreachError: It is not, in time.
        """
        needed = [outlet for name, outlet in self._outlets.items() if name not in deaf]

        def connected() -> bool:
            return all(outlet.get_subscription_count() for outlet in needed) and all(
                inlet.get_publisher_count() for inlet in self._inlets
            )

        if not self._spin_until(connected, _CONNECT_S):
            raise GoalreachError(f'perception did not connect within {_CONNECT_S:g} s')

    def ask(self, stamp_ns: int, sensors: Mapping[str, bytes]) -> dict[str, bytes]:
        """Return what perception answers to the sensors of a stamp.

        Args:
            stamp_ns: The stamp.
            sensors: Serialized message of each sensor.

        Raises:
            GoalreachError: A topic was not answered in time.
        """
        self._stamp_ns = stamp_ns
        self._answers.clear()
        deadline_s = time.monotonic() + _ANSWER_S
        while len(self._answers) < len(OUTPUTS):
            if time.monotonic() > deadline_s:
                silent = ', '.join(name for name in OUTPUTS if name not in self._answers)
                raise GoalreachError(
                    f'no answer on {silent} to the sensors of {stamp_ns * 1e-9:.3f} s'
                )
            for name in SENSORS:
                self._outlets[name].publish(sensors[name])
            self._spin_until(lambda: len(self._answers) == len(OUTPUTS), _REPEAT_S)
        return dict(self._answers)

    def _collector(self, name: str) -> Callable[[bytes], None]:
        def collect(data: bytes) -> None:
            if stamp_of(data) == self._stamp_ns:
                self._answers[name] = data

        return collect

    def _spin_until(self, condition: Callable[[], bool], limit_s: float) -> bool:
        deadline_s = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > deadline_s:
                return False
            self._executor.spin_once(timeout_sec=0.05)
        return True
