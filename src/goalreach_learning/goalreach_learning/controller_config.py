"""Parameters of the controller, of its robot and of its mission: the paths to drive."""

from dataclasses import dataclass, field
from typing import NamedTuple

from goalreach_learning.blending import MODES
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.angles import deg, inches
from goalreach_msgs_py.arena import BODY_RADIUS_M
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.regions import parse_region
from goalreach_msgs_py.values import Pose2


@dataclass(frozen=True, kw_only=True)
class ControllerConfig(Configuration):
    """How the controller drives and whether it learns.

    Raises:
        ConfigurationError: A value is out of its range; the field is named.
    """

    mode: str = parameter('fuzzy', 'How the heading is chosen from the state', choices=MODES)
    cruise_speed_m_per_s: float = parameter(
        inches(20), 'Cruising speed, m/s; 20 in/s is usual of Nomad 200', within=(0.01, inches(20))
    )
    heading_gain_per_s: float = parameter(
        2.0, 'Steering rate per small heading error, 1/s; chosen', within=(0.1, 10.0)
    )
    steering_limit_rad_per_s: float = parameter(
        deg(60), 'Largest steering rate, rad/s (60 deg/s, Nomad 200)', within=(0.05, deg(60.0))
    )
    steering_braking_rad_per_s2: float = parameter(
        deg(20.0),
        'Assumed steering deceleration, rad/s^2: two thirds of the 30 deg/s^2 that drivers of the '
        'Nomad 200 set, the rest compensates the delay of one image; chosen',
        within=(0.01, 10.0),
    )
    stop_heading_error_rad: float = parameter(
        deg(60),
        'Heading error from which it only turns, rad; chosen',
        within=(deg(5.0), deg(90.0)),
    )
    align_tolerance_rad: float = parameter(
        deg(1.0),
        'Heading error that ends a turn on the spot, rad; chosen',
        within=(deg(0.1), deg(30.0)),
    )
    region_margin_m: float = parameter(
        0.04,
        'Distance past a border that ends an action, m: thrice the usual error; chosen',
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
        0.25, 'Distance of the estimate from the start of a path, m; chosen', within=(0.01, 10.0)
    )
    look_around_rad_per_s: float = parameter(
        deg(30.0),
        'Rate at which a robot whose camera no node turns (none publishes /head/command) turns on '
        'the spot while its pose is uncertain, rad/s; 0: never; chosen',
        within=(0.0, deg(60)),
    )
    behaviors: str = parameter(
        'goal',
        'Behaviours and how they combine: goal alone, or such as first(escape, blend(avoid, '
        'patience, goal)); a behaviour of your own is module:function',
    )
    body_radius_m: float = parameter(
        BODY_RADIUS_M, 'Radius of the body that behaviours keep clear, m', within=(0.01, 2.0)
    )
    goal: str = parameter('', 'Goal region as X/Y; empty, and while learning: that of the policy')
    learn: bool = parameter(False, 'Whether to learn while driving, executing actions as options')
    learner: str = parameter(
        'paper', 'Who learns: paper, planner, q-lambda, dyna-q, an entry point, or module:Class'
    )
    learning: LearningConfig = field(default_factory=LearningConfig)

    def __post_init__(self) -> None:
        """Check every field, and that the goal is a region."""
        super().__post_init__()
        if self.goal:
            parse_region(self.goal, field='goal')


@dataclass(frozen=True, kw_only=True)
class RobotConfig(Configuration):
    """What the driven robot takes and sends."""

    stamped_cmd_vel: bool = parameter(
        True, 'Whether /cmd_vel is a geometry_msgs/TwistStamped; otherwise it is a Twist'
    )
    bumpers: str = parameter(
        'required',
        'required: drive only while bumpers report; optional: the robot may have none',
        choices=('required', 'optional'),
    )
    stop_after_s: float = parameter(
        0.0,
        'Silence of /state by the wall clock after which the robot is commanded to stand, as it '
        'is when the node ends, s; 0: the robot stops by itself after the last command',
        within=(0.0, 10.0),
    )
    sonar: str = parameter(
        'required',
        'required: behaviours besides goal-reaching wait for /sonar; none: the robot has no sonar',
        choices=('required', 'none'),
    )


class PathOrder(NamedTuple):
    """One path to be driven.

    Attributes:
        trial: Number of the trial: one trial drives every start once.
        start: Pose at which to place the robot, or None for its present pose.
        waits: Whether it begins when it is requested: somebody else places the robot for it.
    """

    path: int
    trial: int
    start: Pose2 | None = None
    waits: bool = False


@dataclass(frozen=True, kw_only=True)
class MissionConfig(Configuration):
    """The paths to drive, and the policy to drive them with."""

    policy: str = parameter(
        '', "Policy, by name or file; empty: learn one by the paper's procedure, without noise"
    )
    policy_out: str = parameter(
        '', 'Policy file to write after every path while learning; empty: none'
    )
    starts: tuple[float, ...] = parameter(
        (),
        'Starting poses x, y (m), heading (rad) in turn; empty: the robot is not placed: the '
        'first path begins where it stands, a later one when ~/start is called',
    )
    placement_service: str = parameter(
        '', 'Service (std_srvs/Trigger) in the place of starts; empty: none'
    )
    paths: int = parameter(0, 'Number of paths; 0: unlimited', within=(0, 1_000_000))
    paths_per_trial: int = parameter(
        1, 'Number of paths of a trial where there are no starts', within=(1, 1_000_000)
    )
    first_path: int = parameter(
        0, 'Number of the first path, when learning is resumed', within=(0, 1_000_000)
    )
    resume: bool = parameter(False, 'Whether the first path begins where the robot stands')
    consumer: str = parameter(
        '', 'Node whose subscription to the transitions the first path waits for; empty: none'
    )
    seed: int = parameter(0, 'Seed of action selection while learning', within=(0, 2**31 - 1))

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.starts) % 3:
            raise ConfigurationError('starts', self.starts, 'three numbers for each start')

    def path_order(self, path: int) -> PathOrder | None:
        """Return the order of a path by its number, or None after the last one."""
        if self.paths and path >= self.paths:
            return None
        trial, index = divmod(path, len(self.starts) // 3 or self.paths_per_trial)
        if not self.starts or self.resumes(path):
            waits = not (self.starts or self.placement_service) and path > 0
            return PathOrder(path, trial, waits=waits)
        x_m, y_m, heading_rad = self.starts[3 * index : 3 * index + 3]
        return PathOrder(path, trial, Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))

    def resumes(self, path: int) -> bool:
        """Return whether a path continues at the present pose of the robot."""
        return self.resume and path == self.first_path
