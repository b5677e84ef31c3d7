"""The `landmark_localizer` node: from images of the LEDs to a pose and head commands."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import Point, PolygonStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import ImageMarker

from goalreach_msgs_py.alignment import (
    InputAligner,
    Interpolation,
    Sample,
    interpolate_head,
    interpolate_odometry,
)
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.image_messages import decoded_image_from_raw, image_from_raw
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import parameter_infos
from goalreach_msgs_py.pose_messages import estimate_to_raw, odometry_from_raw
from goalreach_msgs_py.ros.messaging import (
    LATCHED_QOS,
    NEWEST_QOS,
    RELIABLE_QOS,
    SAMPLES_QOS,
    SENSOR_QOS,
    AlignedInputs,
    InputReporter,
    StampedReply,
    advertise,
    frame_prefix,
    header,
    resolved_name,
    subscribe_raw,
)
from goalreach_msgs_py.ros.node import Diagnostics, run_nodes
from goalreach_msgs_py.ros.parameters import NodeConfig
from goalreach_msgs_py.ros.transforms import TransformPublisher, map_to_odom
from goalreach_msgs_py.sensor_messages import (
    camera_from_raw,
    head_from_raw,
    head_to_raw,
    landmarks_to_raw,
)
from goalreach_msgs_py.topics import (
    CAMERA_FRAME,
    CAMERA_INFO,
    HEAD_COMMAND,
    HEAD_KINDS,
    IMAGE,
    JOINT_STATES,
    LANDMARK_MARKERS,
    LANDMARKS,
    ODOM,
    POSE,
)
from goalreach_msgs_py.values import LandmarkObservation
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import InputConfig, LocalizerConfig
from goalreach_perception.localizer_output import AT_REST, LocalizerOutput
from goalreach_perception.sensor_monitor import SensorMonitor

_NAME = 'landmark_localizer'
_THROTTLE_S = 5.0
_MARKER_DIAMETER_PX = 12.0
_MARKER_COLOURS = (
    ColorRGBA(r=0.90, g=0.62, b=0.0, a=1.0),
    ColorRGBA(r=0.34, g=0.71, b=0.91, a=1.0),
    ColorRGBA(r=0.0, g=0.62, b=0.45, a=1.0),
)
"""Orange, sky blue and green, distinct with any colour vision; repeated for further LEDs."""


class LandmarkLocalizerNode(Node):
    """Adapter of one `LandmarkLocalizer`.

    Publishes: `/pose`, `/landmarks` and `/head/command` with the stamp of the image;
    `/landmarks/markers` while it has subscribers; `/diagnostics`; `/tf` (map to odom) if tf2_msgs
    is installed.
    Subscribes: `/camera/image_raw`, `/camera/camera_info`, `/joint_states`, `/odom`; processes an
    image with the odometry and the joint angles of its time (see `InputAligner`).
    Parameters: the fields of `LocalizerConfig` and `InputConfig`; `noise.*` may change at run
    time, which restarts the localizer.
    """

    def __init__(self) -> None:
        super().__init__(_NAME)
        self._input_config = inputs = NodeConfig(self, InputConfig).value
        self._joints = HEAD_KINDS[inputs.head]
        live = parameter_infos(NoiseModel, 'noise.')
        config = NodeConfig(self, LocalizerConfig, live=live, on_change=self._on_config)
        self._on_config(config.value)
        self._reply = StampedReply()
        self._prefix = frame_prefix(self)
        self._diagnostics = Diagnostics(self, self._reply)
        self._transforms = TransformPublisher(self)
        self._pose = advertise(self, PoseWithCovarianceStamped, POSE, RELIABLE_QOS)
        self._landmarks = advertise(self, PolygonStamped, LANDMARKS, RELIABLE_QOS)
        self._markers = advertise(self, ImageMarker, LANDMARK_MARKERS, RELIABLE_QOS)
        self._readers: dict[str, Callable[[bytes], object]] = {
            IMAGE: partial(image_from_raw, bits=inputs.image_bits),
            CAMERA_INFO: camera_from_raw,
            ODOM: odometry_from_raw,
            JOINT_STATES: partial(head_from_raw, joints=self._joints),
        }
        followers: dict[str, Interpolation | None] = {
            CAMERA_INFO: None,
            ODOM: interpolate_odometry,
            JOINT_STATES: interpolate_head,
        }
        if self._joints:
            self._head = advertise(self, JointState, HEAD_COMMAND, RELIABLE_QOS)
        else:
            del self._readers[JOINT_STATES], followers[JOINT_STATES]
        wait_s, delay_s = inputs.input_wait_s, config.value.camera_delay_s
        self._inputs = InputAligner(IMAGE, followers, wait_s=wait_s, delay_s=delay_s)
        missing = self._inputs.missing
        suffixes = {IMAGE: '/compressed'} if inputs.image_transport == 'compressed' else {}
        self._reporter = InputReporter(self, self._readers, missing, [CAMERA_INFO], suffixes)
        self._aligned = AlignedInputs(self, self._inputs, self._process)
        self._seeks_camera = True
        self._subscribe()

    def _subscribe(self) -> None:
        image: tuple[type[Any], str] = (Image, IMAGE)
        if self._input_config.image_transport == 'compressed':
            self._readers[IMAGE] = decoded_image_from_raw
            # a name with two slashes is relative to no namespace
            image = (CompressedImage, f'/{resolved_name(self, IMAGE)}/compressed')
        collect = self._collector
        subscribe_raw(self, *image, collect(IMAGE), NEWEST_QOS)
        subscribe_raw(self, CameraInfo, CAMERA_INFO, collect(CAMERA_INFO), SENSOR_QOS)
        subscribe_raw(self, Odometry, ODOM, collect(ODOM), SAMPLES_QOS)
        if self._joints:
            subscribe_raw(self, JointState, JOINT_STATES, collect(JOINT_STATES), SAMPLES_QOS)

    def _find_latched_camera(self) -> None:
        """Subscribe to a CameraInfo that was latched before this node was there."""
        infos = self.get_publishers_info_by_topic(resolved_name(self, CAMERA_INFO))
        if any(i.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL for i in infos):
            self._seeks_camera = False
            collect = self._collector(CAMERA_INFO)
            subscribe_raw(self, CameraInfo, CAMERA_INFO, collect, LATCHED_QOS, entity_id='latched')

    def _collector(self, topic: str) -> Callable[[int, bytes], None]:
        from_raw = self._readers[topic]

        def collect(stamp_ns: int, raw: bytes) -> None:
            self._reporter.received(topic, stamp_ns)
            if self._seeks_camera and not self._inputs.has(CAMERA_INFO):
                self._find_latched_camera()
            try:
                value = from_raw(raw)
            except MessageError as error:
                line = f'input refused: {error}'
                self.get_logger().error(line, throttle_duration_sec=_THROTTLE_S)
                self._diagnostics.tick(stamp_ns, line, dict, ok=False, reply=StampedReply())
                return
            self._aligned.add(topic, stamp_ns, value)

        return collect

    def _process(self, stamp_ns: int, inputs: Mapping[str, Any]) -> None:
        if not self._reply.begin(stamp_ns):
            return
        image, camera, odometry = inputs[IMAGE], inputs[CAMERA_INFO], inputs[ODOM]
        joints = inputs.get(JOINT_STATES, AT_REST)
        self._own_clocks |= not self._inputs.is_exact
        output = self._localizer.process(
            time_ns=stamp_ns,
            image=image,
            camera=camera,
            joints=joints,
            odometry=odometry,
            sampled=self._sampled if self._own_clocks else None,
        )
        self._publish(stamp_ns, output)
        if output.mode == 'refused':
            line = f'refused: {output.reason}'
            self.get_logger().warning(line, throttle_duration_sec=_THROTTLE_S)
            return
        for line in self._monitor.check(
            time_ns=stamp_ns, image=image, camera=camera, odometry=odometry.pose, output=output
        ):
            self.get_logger().info(line)
        if self._transforms.active and output.mode == 'tracking':
            correction = map_to_odom(stamp_ns, output.estimate.pose, odometry.pose)
            self._transforms.publish([correction])

    def _sampled(self, time_ns: int) -> Sample:
        at = self._inputs.follower_at
        return at(JOINT_STATES, time_ns) if self._joints else AT_REST, at(ODOM, time_ns)

    def _on_config(self, config: LocalizerConfig) -> None:
        self._localizer = LandmarkLocalizer(config, self._joints)
        self._own_clocks = config.camera_delay_s != 0.0
        self._monitor = SensorMonitor(config)

    def _publish(self, stamp_ns: int, output: LocalizerOutput) -> None:
        prefix = self._prefix
        self._reply.send(self._pose, estimate_to_raw(output.estimate, stamp_ns, prefix))
        if self._joints:
            command = self._localizer.head_command
            self._reply.send(self._head, head_to_raw(command, stamp_ns, prefix, self._joints))
        self._reply.send(self._landmarks, landmarks_to_raw(output.landmarks, stamp_ns, prefix))
        self._reply.send(self._markers, lambda: image_markers(output.landmarks, stamp_ns, prefix))
        self._diagnostics.tick(
            stamp_ns, output.mode, lambda: output.diagnostics, ok=output.mode == 'tracking'
        )


def image_markers(
    landmarks: Sequence[LandmarkObservation | None], stamp_ns: int, prefix: str = ''
) -> ImageMarker:
    """Return one dot for each detected LED, in pixels, coloured by its number."""
    detected = [(number, led) for number, led in enumerate(landmarks) if led is not None]
    return ImageMarker(
        header=header(stamp_ns, prefix + CAMERA_FRAME),
        ns='leds',
        type=ImageMarker.POINTS,
        action=ImageMarker.ADD if detected else ImageMarker.REMOVE,
        scale=_MARKER_DIAMETER_PX,
        points=[Point(x=float(led.u_px), y=float(led.v_px)) for _, led in detected],
        outline_colors=[_MARKER_COLOURS[number % len(_MARKER_COLOURS)] for number, _ in detected],
    )


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes(_NAME, [LandmarkLocalizerNode]))


if __name__ == '__main__':
    main()
