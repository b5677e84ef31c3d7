"""Parameters of the controller."""

from dataclasses import dataclass, field

from goalreach_learning.blending import MODES
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.angles import INCH_M, deg
from goalreach_msgs_py.parameters import Configuration, parameter


@dataclass(frozen=True, kw_only=True)
class ControllerConfig(Configuration):
    """How the controller drives and whether it learns.

    Raises:
        ConfigurationError: A value is out of its range; the field is named.
    """

    mode: str = parameter('fuzzy', 'How the heading is chosen from the state', choices=MODES)
    cruise_speed_m_per_s: float = parameter(
        round(20.0 * INCH_M, 6),
        'Speed on a straight, m/s (20 in/s, the usual top speed of a Nomad 200)',
        within=(0.01, round(20.0 * INCH_M, 6)),
    )
    heading_gain_per_s: float = parameter(
        2.0, 'Steering rate per small heading error, 1/s; chosen', within=(0.1, 10.0)
    )
    steering_limit_rad_per_s: float = parameter(
        deg(60.0), 'Largest steering rate, rad/s (60 deg/s, Nomad 200)', within=(0.05, deg(60.0))
    )
    steering_braking_rad_per_s2: float = parameter(
        deg(20.0),
        'Assumed steering deceleration, rad/s^2: two thirds of the 30 deg/s^2 that drivers of the '
        'Nomad 200 set, the rest compensates the delay of one image; chosen',
        within=(0.01, 10.0),
    )
    stop_heading_error_rad: float = parameter(
        deg(60.0),
        'Heading error from which the robot only turns, rad; below, it slows down; chosen',
        within=(deg(5.0), deg(90.0)),
    )
    align_tolerance_rad: float = parameter(
        deg(1.0),
        'Heading error at which turning on the spot ends, rad; chosen',
        within=(deg(0.1), deg(30.0)),
    )
    region_margin_m: float = parameter(
        0.04,
        'Distance past a border at which the region counts as left, m: three times the usual '
        'error of the estimate, so that its jitter ends no action; chosen',
        within=(0.0, 0.5),
    )
    goal_confidence: float = parameter(
        0.9999,
        'Probability of being in the goal region at which the goal is declared; chosen: less '
        'than one false goal in the 2000 paths of an evaluation',
        within=(0.5, 1.0),
    )
    timeout_s: float = parameter(
        60.0, 'Time after which a path is truncated, s; chosen', within=(1.0, 3600.0)
    )
    start_tolerance_m: float = parameter(
        0.25,
        'Distance of the estimate from the start at which a path begins, m; chosen',
        within=(0.01, 10.0),
    )
    learn: bool = parameter(
        False, 'Whether to learn while driving: actions by equation (2), executed as options'
    )
    learning: LearningConfig = field(default_factory=LearningConfig)
