"""From image to state: LED spots, pose with covariance, regions and memberships."""

from goalreach_perception.detection import SpotDetector, Spots
from goalreach_perception.head_tracker import HeadTracker
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerCounters, LocalizerOutput
from goalreach_perception.pose_filter import PoseFilter
from goalreach_perception.pose_monitor import Mode, PoseMonitor
from goalreach_perception.sensor_monitor import SensorMonitor
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig

__all__ = [
    'HeadTracker',
    'LandmarkLocalizer',
    'LocalizerConfig',
    'LocalizerCounters',
    'LocalizerOutput',
    'Mode',
    'PoseFilter',
    'PoseMonitor',
    'SensorMonitor',
    'SpotDetector',
    'Spots',
    'StateEstimator',
    'StateEstimatorConfig',
]
