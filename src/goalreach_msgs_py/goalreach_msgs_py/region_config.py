"""The region map as parameters, for every node that needs it."""

from __future__ import annotations

from dataclasses import dataclass

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.regions import (
    DEFAULT_X_KNOTS_M,
    DEFAULT_Y_KNOTS_M,
    GOAL_REGION,
    RegionMap,
    parse_region,
    region_name,
)

__all__ = ['RegionConfig']


@dataclass(frozen=True, kw_only=True)
class RegionConfig:
    """Knots and goal of a `RegionMap`."""

    x_knots_m: tuple[float, ...] = parameter(
        DEFAULT_X_KNOTS_M, 'Knots x0..x5 of LEFT-SIDE, FRONT, RIGHT-SIDE, m (Fig. 5a)', length=6
    )
    y_knots_m: tuple[float, ...] = parameter(
        DEFAULT_Y_KNOTS_M, 'Knots y0..y5 of NEAR, MEDIUM, FAR, m (Fig. 5b)', length=6
    )
    goal_region: str = parameter(region_name(GOAL_REGION), 'The goal state, as X/Y')

    def __post_init__(self) -> None:
        """Check every field and that they make a region map."""
        check_fields(self)
        try:
            _ = self.region_map
        except ConfigurationError as error:
            field = 'goal_region' if error.field == 'region' else error.field
            raise ConfigurationError(field, error.value, error.allowed) from None

    @property
    def region_map(self) -> RegionMap:
        """The region map that these parameters describe."""
        return RegionMap(
            x_knots_m=self.x_knots_m, y_knots_m=self.y_knots_m, goal=parse_region(self.goal_region)
        )

    @classmethod
    def for_map(cls, regions: RegionMap) -> RegionConfig:
        """Return the parameters that describe a region map."""
        return cls(
            x_knots_m=regions.x_knots_m,
            y_knots_m=regions.y_knots_m,
            goal_region=region_name(regions.goal),
        )
