"""From image to state: LED spots, pose with covariance, regions and memberships."""

from typing import TYPE_CHECKING

from goalreach_msgs_py.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from goalreach_perception.detection import SpotDetector as SpotDetector
    from goalreach_perception.detection import Spots as Spots
    from goalreach_perception.head_tracker import HeadTracker as HeadTracker
    from goalreach_perception.localizer import LandmarkLocalizer as LandmarkLocalizer
    from goalreach_perception.localizer_config import LocalizerConfig as LocalizerConfig
    from goalreach_perception.localizer_output import LocalizerCounters as LocalizerCounters
    from goalreach_perception.localizer_output import LocalizerOutput as LocalizerOutput
    from goalreach_perception.pose_filter import PoseFilter as PoseFilter
    from goalreach_perception.pose_monitor import Mode as Mode
    from goalreach_perception.pose_monitor import PoseMonitor as PoseMonitor
    from goalreach_perception.sensor_monitor import SensorMonitor as SensorMonitor
    from goalreach_perception.state_estimator import StateEstimator as StateEstimator
    from goalreach_perception.state_estimator import StateEstimatorConfig as StateEstimatorConfig

__all__, __getattr__, __dir__ = lazy_exports(__name__)
