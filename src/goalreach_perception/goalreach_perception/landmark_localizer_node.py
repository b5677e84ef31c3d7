"""The `landmark_localizer` node: from images of the LEDs to a pose and head commands."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image, JointState
from visualization_msgs.msg import ImageMarker

from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.inputs import StampSynchronizer
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.pose_messages import estimate_to_raw, odometry_from_raw
from goalreach_msgs_py.ros.messaging import (
    NEWEST_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    InputReporter,
    StampedReply,
    subscribe_raw,
)
from goalreach_msgs_py.ros.node import Diagnostics, run_nodes
from goalreach_msgs_py.ros.parameters import NodeConfig
from goalreach_msgs_py.ros.transforms import TransformPublisher, map_to_odom
from goalreach_msgs_py.sensor_messages import (
    camera_from_raw,
    head_from_raw,
    head_to_raw,
    image_from_raw,
    landmarks_to_raw,
)
from goalreach_msgs_py.topics import (
    CAMERA_INFO,
    HEAD_COMMAND,
    IMAGE,
    JOINT_STATES,
    LANDMARK_MARKERS,
    LANDMARKS,
    ODOM,
    POSE,
)
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_perception.ros.image_markers import image_markers
from goalreach_perception.sensor_monitor import SensorMonitor

_NAME = 'landmark_localizer'
_THROTTLE_S = 5.0
_FROM_RAW: dict[str, Callable[[bytes], object]] = {
    IMAGE: image_from_raw,
    CAMERA_INFO: camera_from_raw,
    JOINT_STATES: head_from_raw,
    ODOM: odometry_from_raw,
}


class LandmarkLocalizerNode(Node):
    """Adapter of one `LandmarkLocalizer`.

    Publishes: `/pose`, `/landmarks` and `/head/command` with the stamp of the image;
    `/landmarks/markers` while it has subscribers; `/diagnostics`; `/tf` (map to odom) if tf2_msgs
    is installed.
    Subscribes: `/camera/image_raw`, `/camera/camera_info`, `/joint_states`, `/odom`; processes a
    stamp once all four have arrived.
    Parameters: the fields of `LocalizerConfig`; `noise.*` may change at run time, which restarts
    the localizer.
    """

    def __init__(self) -> None:
        super().__init__(_NAME)
        live = [f'noise.{field.name}' for field in fields(NoiseModel)]
        config = NodeConfig(self, LocalizerConfig, live=live, on_change=self._on_config)
        self._on_config(config.value)
        topics = [IMAGE, CAMERA_INFO, JOINT_STATES, ODOM]
        self._inputs = StampSynchronizer(topics)
        self._reporter = InputReporter(self, topics, self._inputs.missing)
        self._reply = StampedReply()
        self._diagnostics = Diagnostics(self)
        self._transforms = TransformPublisher(self)
        self._pose = self.create_publisher(PoseWithCovarianceStamped, POSE, RELIABLE_QOS)
        self._landmarks = self.create_publisher(PolygonStamped, LANDMARKS, RELIABLE_QOS)
        self._head = self.create_publisher(JointState, HEAD_COMMAND, RELIABLE_QOS)
        self._markers = self.create_publisher(ImageMarker, LANDMARK_MARKERS, RELIABLE_QOS)
        for message_type, topic, qos in (
            (Image, IMAGE, NEWEST_QOS),
            (CameraInfo, CAMERA_INFO, SENSOR_QOS),
            (JointState, JOINT_STATES, RELIABLE_QOS),
            (Odometry, ODOM, RELIABLE_QOS),
        ):
            subscribe_raw(self, message_type, topic, self._collector(topic), qos)

    def _collector(self, topic: str) -> Callable[[int, bytes], None]:
        from_raw = _FROM_RAW[topic]

        def collect(stamp_ns: int, raw: bytes) -> None:
            self._reporter.received(topic, stamp_ns)
            try:
                value = from_raw(raw)
            except MessageError as error:
                line = f'input refused: {error}'
                self.get_logger().error(line, throttle_duration_sec=_THROTTLE_S)
                self._diagnostics.tick(stamp_ns, line, dict, ok=False)
                return
            inputs = self._inputs.add(topic, stamp_ns, value)
            if inputs is not None and self._reply.begin(stamp_ns):
                self._process(stamp_ns, inputs)

        return collect

    def _process(self, stamp_ns: int, inputs: Mapping[str, Any]) -> None:
        image, camera, joints = inputs[IMAGE], inputs[CAMERA_INFO], inputs[JOINT_STATES]
        odometry = inputs[ODOM]
        output = self._localizer.process(
            time_ns=stamp_ns, image=image, camera=camera, joints=joints, odometry=odometry
        )
        self._publish(stamp_ns, output)
        if output.mode == 'refused':
            line = f'refused: {output.reason}'
            self.get_logger().warning(line, throttle_duration_sec=_THROTTLE_S)
            return
        for line in self._monitor.check(
            time_ns=stamp_ns,
            image=image,
            camera=camera,
            joints=joints,
            odometry=odometry.pose,
            output=output,
        ):
            self.get_logger().info(line)
        if self._transforms.active and output.mode == 'tracking':
            correction = map_to_odom(stamp_ns, output.estimate.pose, odometry.pose)
            self._transforms.publish([correction])

    def _on_config(self, config: LocalizerConfig) -> None:
        self._localizer = LandmarkLocalizer(config)
        self._monitor = SensorMonitor(config)

    def _publish(self, stamp_ns: int, output: LocalizerOutput) -> None:
        self._reply.send(self._pose, estimate_to_raw(output.estimate, stamp_ns))
        self._reply.send(self._head, head_to_raw(self._localizer.head_command, stamp_ns))
        self._reply.send(self._landmarks, landmarks_to_raw(output.landmarks, stamp_ns))
        if self._markers.get_subscription_count():
            self._markers.publish(image_markers(output.landmarks, stamp_ns))
        self._diagnostics.tick(
            stamp_ns, output.mode, lambda: output.diagnostics, ok=output.mode == 'tracking'
        )


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes(_NAME, [LandmarkLocalizerNode]))


if __name__ == '__main__':
    main()
