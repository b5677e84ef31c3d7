"""What behaviours proposed and who was heard, as statuses and as arrows for viewers."""

from collections.abc import Sequence
import math

from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from goalreach_learning.behaviors import Opinion
from goalreach_msgs_py.diagnostic_messages import Status, statuses_to_raw
from goalreach_msgs_py.ros.messaging import header
from goalreach_msgs_py.topics import CONTROLLER, MAP_FRAME
from goalreach_msgs_py.values import Pose2

_HEARD = ColorRGBA(r=0.0, g=0.62, b=0.45, a=1.0)
_UNHEARD = ColorRGBA(r=0.6, g=0.6, b=0.6, a=0.7)
_SIZE_M = (0.6, 0.04, 0.06)
_ABOVE_M = 1.3


def opinions_to_raw(opinions: Sequence[Opinion], stamp_ns: int) -> bytes:
    """Return opinions as diagnostic_msgs/DiagnosticArray, one status per behaviour."""
    statuses = []
    for one in opinions:
        values = {'heard': str(one.heard).lower()}
        for name in ('heading_rad', 'weight', 'limit_m_per_s'):
            if (value := getattr(one.proposal, name, None)) is not None:
                values[name] = repr(value)
        said = 'nothing' if one.proposal is None else 'heard' if one.heard else 'not heard'
        statuses.append(Status(name=one.name, message=said, hardware_id=CONTROLLER, values=values))
    return statuses_to_raw(statuses, stamp_ns)


def opinion_markers(
    opinions: Sequence[Opinion], pose: Pose2, stamp_ns: int, prefix: str
) -> MarkerArray:
    """Return an arrow above the robot for each proposed direction; what is heard is green."""
    markers = []
    for index, one in enumerate(opinions):
        heading_rad = one.proposal.heading_rad if one.proposal else None
        marker = Marker(header=header(stamp_ns, prefix + MAP_FRAME), ns='behaviors', id=index)
        marker.type, marker.color = Marker.ARROW, _HEARD if one.heard else _UNHEARD
        marker.action = Marker.DELETE if heading_rad is None else Marker.ADD
        marker.pose.position.x, marker.pose.position.y = pose.x_m, pose.y_m
        marker.pose.position.z = _ABOVE_M + 0.1 * index
        marker.pose.orientation.z = math.sin((heading_rad or 0.0) / 2.0)
        marker.pose.orientation.w = math.cos((heading_rad or 0.0) / 2.0)
        marker.scale.x, marker.scale.y, marker.scale.z = _SIZE_M
        markers.append(marker)
    return MarkerArray(markers=markers)
