"""Values, camera model, regions, arena, parameters and topics, and the messages that carry them.

Everything here works without ROS; what needs rclpy is in `goalreach_msgs_py.ros`. Conversions
between values and serialized messages are in `pose_messages`, `sensor_messages` and
`diagnostic_messages`, names in `topics`.
"""

from typing import TYPE_CHECKING

from goalreach_msgs_py.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from goalreach_msgs_py.angles import angle_difference as angle_difference
    from goalreach_msgs_py.angles import wrap_angle as wrap_angle
    from goalreach_msgs_py.arena import Arena as Arena
    from goalreach_msgs_py.arena_file import read_arena as read_arena
    from goalreach_msgs_py.camera import PinholeCamera as PinholeCamera
    from goalreach_msgs_py.cdr import MessageError as MessageError
    from goalreach_msgs_py.cdr import stamp_of as stamp_of
    from goalreach_msgs_py.errors import ConfigurationError as ConfigurationError
    from goalreach_msgs_py.errors import FileFormatError as FileFormatError
    from goalreach_msgs_py.errors import GoalreachError as GoalreachError
    from goalreach_msgs_py.inputs import InputMonitor as InputMonitor
    from goalreach_msgs_py.inputs import StampSynchronizer as StampSynchronizer
    from goalreach_msgs_py.noise import NoiseModel as NoiseModel
    from goalreach_msgs_py.noise import noise_preset as noise_preset
    from goalreach_msgs_py.parameters import Configuration as Configuration
    from goalreach_msgs_py.parameters import build_config as build_config
    from goalreach_msgs_py.parameters import parameter as parameter
    from goalreach_msgs_py.regions import RegionMap as RegionMap
    from goalreach_msgs_py.regions import parse_region as parse_region
    from goalreach_msgs_py.regions import region_name as region_name
    from goalreach_msgs_py.values import Confidence as Confidence
    from goalreach_msgs_py.values import HeadAngles as HeadAngles
    from goalreach_msgs_py.values import LandmarkObservation as LandmarkObservation
    from goalreach_msgs_py.values import Odometry as Odometry
    from goalreach_msgs_py.values import PathOutcome as PathOutcome
    from goalreach_msgs_py.values import Pose2 as Pose2
    from goalreach_msgs_py.values import PoseEstimate as PoseEstimate
    from goalreach_msgs_py.values import RegionState as RegionState
    from goalreach_msgs_py.values import Transition as Transition
    from goalreach_msgs_py.values import Twist2 as Twist2

__all__, __getattr__, __dir__ = lazy_exports(__name__)
