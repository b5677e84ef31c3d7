import math

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.obstacles import Obstacle, obstacles_from_flat, obstacles_to_flat
from goalreach_msgs_py.values import Pose2, Twist2
from goalreach_sim.robot import Robot
from goalreach_sim.simulator_config import DriveConfig
from goalreach_sim.walls import Walls

RADIUS_M = 0.25
CYLINDER = Obstacle(x_m=2.0, y_m=3.0, radius_m=0.5)
BOX = Obstacle(x_m=2.0, y_m=3.0, length_m=1.0, width_m=0.4, heading_rad=math.pi / 2)


def robot_among(*obstacles: Obstacle, at: tuple[float, float, float]) -> Robot:
    walls = Walls(width_m=4.0, length_m=6.0, body_radius_m=RADIUS_M, obstacles=obstacles)
    robot = Robot(DriveConfig(), walls, watchdog_s=60.0)
    robot.place(Pose2(x_m=at[0], y_m=at[1], heading_rad=at[2]))
    return robot


def drive(robot: Robot, speed: float, rate: float, time_s: float, steps: int = 1) -> None:
    robot.drive(Twist2(linear_m_per_s=speed, steering_rad_per_s=rate))
    for _ in range(steps):
        robot.advance(time_s / steps)
        robot.walls.advance(time_s / steps, robot.x_m, robot.y_m)


def gap_m(robot: Robot) -> float:
    return min(one.contact(robot.x_m, robot.y_m)[0] for one in robot.walls.obstacles) - RADIUS_M


def test_distances_by_hand() -> None:
    assert CYLINDER.contact(2.0, 1.5) == pytest.approx((1.0, math.pi / 2))
    # The long side of the box lies along y: it reaches from 2.5 to 3.5, and from 1.8 to 2.2 in x.
    assert BOX.contact(1.0, 3.2) == pytest.approx((0.8, 0.0))
    distance_m, azimuth_rad = BOX.contact(1.5, 2.1)  # 0.3 and 0.4 m before a corner
    assert distance_m == pytest.approx(0.5)
    assert azimuth_rad == pytest.approx(math.atan2(0.4, 0.3))
    assert BOX.contact(2.15, 3.0)[0] == pytest.approx(-0.05)


def test_chords_by_hand() -> None:
    assert CYLINDER.chord(0.0, 3.0, 4.0, 0.0) == pytest.approx((0.375, 0.625))
    assert CYLINDER.chord(0.0, 2.4, 4.0, 0.0) is None
    assert BOX.chord(0.0, 3.0, 4.0, 0.0) == pytest.approx((0.45, 0.55))
    assert BOX.chord(0.0, 3.6, 4.0, 0.0) is None


@pytest.mark.parametrize('steps', [1, 7, 200])
def test_the_robot_stops_where_it_touches_whatever_the_step(steps: int) -> None:
    robot = robot_among(CYLINDER, at=(1.8, 1.0, math.pi / 2))
    drive(robot, 0.4, 0.0, 8.0, steps)
    # Its centre stops 0.75 m from that of the cylinder, 0.2 m aside.
    assert robot.y_m == pytest.approx(3.0 - math.sqrt(0.75**2 - 0.2**2), abs=1e-9)
    azimuth_deg = math.degrees(math.asin(0.2 / 0.75))
    pressed = [i for i, on in enumerate(robot.bumpers) if on]
    assert pressed == [0, 19], azimuth_deg


def test_backwards_it_leaves_what_it_touches() -> None:
    robot = robot_among(BOX, at=(2.0, 1.0, math.pi / 2))
    drive(robot, 0.4, 0.0, 8.0)
    assert gap_m(robot) == pytest.approx(0.0, abs=1e-9)
    drive(robot, -0.4, 0.0, 1.0)
    assert gap_m(robot) > 0.1
    assert not any(robot.bumpers)


numbers = st.floats(0.0, 1.0)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(numbers, numbers, numbers), min_size=5, max_size=12), numbers)
def test_no_drive_enters_an_obstacle(
    commands: list[tuple[float, float, float]], heading: float
) -> None:
    others = Obstacle(x_m=1.0, y_m=1.2, length_m=0.6, width_m=0.2, heading_rad=0.4)
    robot = robot_among(CYLINDER, others, at=(3.0, 1.5, math.tau * heading))
    for speed, rate, time_s in commands:
        drive(robot, speed - 0.4, 2.0 * rate - 1.0, 3.0 * time_s, 3)
        assert gap_m(robot) >= -1e-9
        assert robot.walls.clearance_m(robot.x_m, robot.y_m) >= -1e-9


def test_a_moving_obstacle_turns_back_where_it_runs_into_the_robot() -> None:
    moving = Obstacle(x_m=0.5, y_m=2.0, radius_m=0.25, speed_m_per_s=0.2, track_m=((3.5, 2.0),))
    robot = robot_among(moving, at=(2.0, 2.0, math.pi / 2))
    # It touches at x = 1.5 after five seconds, and is a metre back five seconds later.
    drive(robot, 0.0, 0.0, 5.0, 125)
    assert robot.walls.obstacles[0].x_m == pytest.approx(1.5, abs=1e-9)
    assert gap_m(robot) == pytest.approx(0.0, abs=1e-9)
    drive(robot, 0.0, 0.0, 5.0, 125)
    assert robot.walls.obstacles[0].x_m == pytest.approx(0.5, abs=0.01)


def test_a_track_returns_to_its_start() -> None:
    square = Obstacle(
        x_m=1.0, y_m=1.0, radius_m=0.1, speed_m_per_s=0.1, track_m=((2.0, 1.0), (2.0, 3.0))
    )
    lap_m = 1.0 + 2.0 + math.sqrt(5.0)
    for driven_m, place in ((0.5, (1.5, 1.0)), (2.0, (2.0, 2.0)), (lap_m + 0.25, (1.25, 1.0))):
        there = square.after(driven_m)
        assert (there.x_m, there.y_m) == pytest.approx(place)


def test_obstacles_survive_as_numbers() -> None:
    obstacles = (
        CYLINDER,
        BOX,
        Obstacle(
            x_m=1.0, y_m=1.0, radius_m=0.1, speed_m_per_s=0.1, track_m=((2.0, 1.0), (2.0, 3.0))
        ),
    )
    assert obstacles_from_flat(obstacles_to_flat(obstacles)) == obstacles
    with pytest.raises(ConfigurationError, match='obstacles'):
        obstacles_from_flat(obstacles_to_flat(obstacles)[:-1])


@pytest.mark.parametrize(
    ('fields', 'name'),
    [
        ({}, 'radius_m'),
        ({'radius_m': 0.1, 'length_m': 1.0, 'width_m': 1.0}, 'radius_m'),
        ({'radius_m': 0.1, 'height_m': -1.0}, 'height_m'),
        ({'radius_m': 0.1, 'speed_m_per_s': 9.0}, 'speed_m_per_s'),
        ({'radius_m': 0.1, 'speed_m_per_s': 0.5}, 'track_m'),
    ],
)
def test_impossible_obstacles_are_refused(fields: dict[str, float], name: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        Obstacle(x_m=1.0, y_m=1.0, **fields)  # type: ignore[arg-type]
    assert refused.value.field == name
