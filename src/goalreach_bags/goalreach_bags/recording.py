"""Topics of a run that a recording expects, and what its bag keeps besides messages."""

from collections.abc import Mapping
import json
from typing import Final

from goalreach_msgs_py import topics

TICK_TOPICS: Final = (
    topics.CLOCK, topics.GROUND_TRUTH, *topics.SENSORS, topics.POSE, topics.LANDMARKS,
    topics.HEAD_COMMAND, topics.STATE, topics.CMD_VEL,
)  # fmt: skip
"""Topics with one message in each tick of a run."""

RUN_TOPICS: Final = (
    *TICK_TOPICS,
    topics.MARKERS,
    topics.TRANSITION,
    topics.Q_TABLE,
    topics.PATH,
    topics.DIAGNOSTICS,
)
"""All topics of a run's four nodes."""
UNSTAMPED: Final = (topics.MARKERS, topics.Q_TABLE, topics.MODEL, topics.BEHAVIOR_MARKERS)
"""Those of the nodes without stamps."""

OUTPUT_TYPES: Final = {
    topics.DIAGNOSTICS: 'diagnostic_msgs/msg/DiagnosticArray',
    topics.LANDMARK_MARKERS: 'visualization_msgs/msg/ImageMarker',
    topics.LANDMARKS: 'geometry_msgs/msg/PolygonStamped',
    topics.POSE: 'geometry_msgs/msg/PoseWithCovarianceStamped',
    topics.STATE: 'diagnostic_msgs/msg/DiagnosticArray',
}
"""What a run's recorder subscribes to first, before there is a publisher: the outputs of
perception, which a recomputation needs from the first on, and what a whole tick can be without.
A node that sends a whole tick to the recorder has discovered these subscriptions before."""

LOST_KEY: Final = 'goalreach.lost'
CLOCK_KEY: Final = 'goalreach.clock'
PARAMETERS_KEY: Final = 'goalreach.parameters'


def lost_messages(texts: Mapping[str, str]) -> dict[str, int]:
    """Return the lost messages by topic in the texts of a bag; none where it has no count."""
    try:
        lost = json.loads(texts.get(LOST_KEY, '{}'))
        return {str(name): int(count) for name, count in lost.items()}
    except (ValueError, TypeError, AttributeError):
        return {}
