"""AprilTags as landmarks: where they hang, and where their corners are."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import FloatArray

FAMILIES: Final = {'16h5': 30, '25h9': 35, '36h10': 2320, '36h11': 587}
"""Families of AprilTags (Olson, ICRA 2011), and how many tags each has."""
CORNERS: Final = 4
_FIELDS: Final = 6
_LARGEST_M: Final = 5.0
ROTATION_SIGMA_RAD: Final = 0.01
"""Error of each angle at which a tag hangs. Chosen: 2 mm across a tag of 0.2 m."""
_FLATNESS_SIGMA_M: Final = 0.0003
"""Error of a corner in the plane of its tag. Chosen: print and paper."""


@dataclass(frozen=True, kw_only=True)
class Tag:
    """An upright tag on a vertical surface.

    Attributes:
        id: Its number in its family.
        size_m: Side of its black square.
        x_m: Centre in `map`.
        y_m: Centre in `map`.
        z_m: Height of the centre above the floor.
        facing_rad: Direction in which it faces, in `map`.

    Raises:
        ConfigurationError: A number is impossible.
    """

    id: int
    size_m: float
    x_m: float
    y_m: float
    z_m: float
    facing_rad: float

    def __post_init__(self) -> None:
        if self.id < 0:
            raise ConfigurationError('id', self.id, 'a number of the family')
        if not 0.0 < self.size_m <= _LARGEST_M:
            raise ConfigurationError('size_m', self.size_m, f'more than 0, at most {_LARGEST_M:g}')
        if not self.z_m > 0.5 * self.size_m:
            raise ConfigurationError('z_m', self.z_m, 'high enough for the tag to hang')
        if not math.isfinite(self.facing_rad):
            raise ConfigurationError('facing_deg', self.facing_rad, 'finite')

    @property
    def axes(self) -> FloatArray:
        """Unit vectors to the right as one looks at it, up and outward, (3, 3), in `map`."""
        cosine, sine = math.cos(self.facing_rad), math.sin(self.facing_rad)
        return np.array([[-sine, cosine, 0.0], [0.0, 0.0, 1.0], [cosine, sine, 0.0]])

    @property
    def corners_m(self) -> FloatArray:
        """Corners of the black square from the upper left, clockwise, (4, 3), in `map`."""
        right, up, _ = 0.5 * self.size_m * self.axes
        centre = np.array([self.x_m, self.y_m, self.z_m])
        return np.array(
            [centre + a * right + b * up for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
        )

    @property
    def corner_effects(self) -> FloatArray:
        """Shifts of x, y, z of each corner by small errors of the tag, (6, 12).

        The errors are those of its place along x, y and z, and turns about its `axes`.
        """
        offsets_m = self.corners_m - (self.x_m, self.y_m, self.z_m)
        turned = [np.cross(axis, offsets_m).reshape(-1) for axis in self.axes]
        return np.array([*(np.tile(axis, CORNERS) for axis in np.eye(3)), *turned])

    def corner_covariance_m2(self, survey_sigma_m: float) -> FloatArray:
        """Return the covariance of the corners' coordinates by errors of place and angles.

        Args:
            survey_sigma_m: Error of each coordinate of the centre (1 sigma).

        Returns:
            (12, 12), x, y, z of each corner in turn.
        """
        moved, turned = np.split(self.corner_effects, 2)
        effects = moved * survey_sigma_m, turned * ROTATION_SIGMA_RAD
        flat = _FLATNESS_SIGMA_M**2 * np.eye(3 * CORNERS)
        return np.asarray(sum(part.T @ part for part in effects) + flat, np.float64)


def tags_to_flat(tags: Iterable[Tag]) -> tuple[float, ...]:
    """Return tags as the numbers of a parameter: the fields of each in turn."""
    return tuple(float(value) for tag in tags for value in vars(tag).values())


def tags_from_flat(values: Sequence[float]) -> tuple[Tag, ...]:
    """Return the tags that `tags_to_flat` wrote.

    Raises:
        ConfigurationError: Numbers are missing, or describe no tag.
    """
    if len(values) % _FIELDS:
        allowed = 'id, size, x, y, z and facing of each tag'
        raise ConfigurationError('tags', tuple(values), allowed)
    names = tuple(Tag.__dataclass_fields__)[1:]
    rows = [values[k : k + _FIELDS] for k in range(0, len(values), _FIELDS)]
    for number, *_ in rows:
        if number % 1.0:
            raise ConfigurationError('tags', number, 'a whole number as the id of a tag')
    return tuple(Tag(id=int(row[0]), **dict(zip(names, row[1:], strict=True))) for row in rows)


def tag_dictionary(family: str) -> cv2.aruco.Dictionary:
    """Return OpenCV's dictionary of a family."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f'DICT_APRILTAG_{family}'))


def tag_pattern(family: str, number: int) -> NDArray[np.uint8]:
    """Return the cells of a tag, one pixel each, 0 or 255, with a white margin of one."""
    dictionary = tag_dictionary(family)
    square = cv2.aruco.generateImageMarker(dictionary, number, dictionary.markerSize + 2)
    return np.pad(np.asarray(square, np.uint8), 1, constant_values=255)


def check_tags(tags: Sequence[Tag], family: str) -> None:
    """Check that tags are of a family, each there once.

    Raises:
        ConfigurationError: They are not.
    """
    if family not in FAMILIES:
        raise ConfigurationError('tag_family', family, 'one of ' + ', '.join(FAMILIES))
    for index, tag in enumerate(tags):
        if tag.id >= FAMILIES[family]:
            raise ConfigurationError(f'tags[{index}].id', tag.id, f'less than {FAMILIES[family]}')
        if any(tag.id == other.id for other in tags[:index]):
            raise ConfigurationError(f'tags[{index}].id', tag.id, 'another than the others')
