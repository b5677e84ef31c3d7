"""The detected LEDs as visualization_msgs/ImageMarker, for viewers that overlay the image."""

from collections.abc import Sequence

from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import ImageMarker

from goalreach_msgs_py.ros.messaging import header
from goalreach_msgs_py.topics import CAMERA_FRAME
from goalreach_msgs_py.values import LandmarkObservation

_NAMESPACE = 'leds'
_DIAMETER_PX = 12.0
_COLOURS = (
    ColorRGBA(r=0.90, g=0.62, b=0.0, a=1.0),
    ColorRGBA(r=0.34, g=0.71, b=0.91, a=1.0),
    ColorRGBA(r=0.0, g=0.62, b=0.45, a=1.0),
)
"""Orange, sky blue and green, distinct with any colour vision; repeated for further LEDs."""


def image_markers(
    landmarks: Sequence[LandmarkObservation | None], stamp_ns: int, prefix: str = ''
) -> ImageMarker:
    """Return one dot for each detected LED, in pixels, coloured by its number."""
    detected = [(number, led) for number, led in enumerate(landmarks) if led is not None]
    return ImageMarker(
        header=header(stamp_ns, prefix + CAMERA_FRAME),
        ns=_NAMESPACE,
        type=ImageMarker.POINTS,
        action=ImageMarker.ADD if detected else ImageMarker.REMOVE,
        scale=_DIAMETER_PX,
        points=[Point(x=float(led.u_px), y=float(led.v_px)) for _, led in detected],
        outline_colors=[_COLOURS[number % len(_COLOURS)] for number, _ in detected],
    )
