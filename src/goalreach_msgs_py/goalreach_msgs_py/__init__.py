"""Values, camera model, regions, arena, parameters and topics, and the messages that carry them.

Everything here works without ROS; what needs rclpy is in `goalreach_msgs_py.ros`. Conversions
between values and serialized messages are in `pose_messages`, `sensor_messages` and
`diagnostic_messages`, names in `topics`.
"""

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, GoalreachError
from goalreach_msgs_py.inputs import InputMonitor, StampSynchronizer
from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.parameters import Configuration, build_config, parameter
from goalreach_msgs_py.regions import RegionMap, parse_region, region_name
from goalreach_msgs_py.values import (
    Confidence,
    HeadAngles,
    LandmarkObservation,
    Odometry,
    PathOutcome,
    Pose2,
    PoseEstimate,
    RegionState,
    Transition,
    Twist2,
)

__all__ = [
    'Arena',
    'Confidence',
    'Configuration',
    'ConfigurationError',
    'FileFormatError',
    'GoalreachError',
    'HeadAngles',
    'InputMonitor',
    'LandmarkObservation',
    'MessageError',
    'NoiseModel',
    'Odometry',
    'PathOutcome',
    'PinholeCamera',
    'Pose2',
    'PoseEstimate',
    'RegionMap',
    'RegionState',
    'StampSynchronizer',
    'Transition',
    'Twist2',
    'angle_difference',
    'build_config',
    'noise_preset',
    'parameter',
    'parse_region',
    'read_arena',
    'region_name',
    'stamp_of',
    'wrap_angle',
]
