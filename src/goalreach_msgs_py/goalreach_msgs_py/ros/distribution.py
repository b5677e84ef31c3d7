"""What depends on the distribution of ROS 2; everything else is the same in those that are known.

Jazzy is supported: tested, locked, and the one whose message definitions bags hold. Kilted works.
"""

from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final


@dataclass(frozen=True, kw_only=True)
class Distribution:
    """A distribution.

    Attributes:
        name: Its name, as in ROS_DISTRO and in the names of wheels, `ros-NAME-rclpy`.
        rclpy_major: First number of the version of its rclpy.
        profile_variable: Environment variable in which its Fast DDS looks for a profile.
        profile_suffix: Ends the names of its profiles: Fast DDS 3 spells an element otherwise.
        node_takes_rosout_qos: Whether rclpy's own class of nodes takes a profile for `/rosout`.
    """

    name: str
    rclpy_major: int
    profile_variable: str
    profile_suffix: str = ''
    node_takes_rosout_qos: bool


JAZZY: Final = Distribution(
    name='jazzy',
    rclpy_major=7,
    profile_variable='FASTRTPS_DEFAULT_PROFILES_FILE',
    node_takes_rosout_qos=False,
)
KILTED: Final = Distribution(
    name='kilted',
    rclpy_major=9,
    profile_variable='FASTDDS_DEFAULT_PROFILES_FILE',
    profile_suffix='_kilted',
    node_takes_rosout_qos=True,
)


@lru_cache(maxsize=1)
def installed() -> Distribution:
    """Return the distribution of the rclpy that would be imported; of a newer one, Kilted.

    The name of a folder next to rclpy holds its version: `importlib.metadata` takes 30 ms.
    """
    spec = find_spec('rclpy')
    origin = spec.origin if spec else None
    beside = Path(origin).parents[1].glob('rclpy-*-info') if origin else ()
    majors = [path.name.removeprefix('rclpy-').partition('.')[0] for path in beside]
    newer = any(major.isdecimal() and int(major) > JAZZY.rclpy_major for major in majors)
    return KILTED if newer else JAZZY
