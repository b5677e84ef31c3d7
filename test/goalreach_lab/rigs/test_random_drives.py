"""Random drives for the peers: repeatable, and driven by IR-SIM as by our robot."""

import numpy as np
import pytest

from goalreach_lab.rigs.random_drives import STEP_S, STEPS, IrSimDrives, RandomDrives
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import Pose2, Twist2
from goalreach_sim.robot import Robot
from goalreach_sim.simulator_config import DriveConfig
from goalreach_sim.walls import Walls


def drive_one(drives: RandomDrives, index: int, arena: Arena) -> Pose2:
    """Drive a single one of them; return where it ends."""
    walls = Walls(width_m=arena.width_m, length_m=arena.length_m, body_radius_m=BODY_RADIUS_M)
    robot = Robot(DriveConfig(), walls, watchdog_s=0.5)
    x_m, y_m, heading_rad = drives.starts[:, index].tolist()
    robot.place(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    for step in range(STEPS):
        speed, turn = drives.command(step)[:, index].tolist()
        robot.drive(Twist2(linear_m_per_s=speed, steering_rad_per_s=turn))
        robot.advance(STEP_S)
    return robot.truth.pose


def test_drives_are_the_same_for_the_same_seed_and_stay_inside() -> None:
    one, again = (RandomDrives.draw(40, Arena(), np.random.default_rng(3)) for _ in range(2))
    ends = [drive_one(one, index, Arena()) for index in range(40)]
    assert ends == [drive_one(again, index, Arena()) for index in range(40)]
    places = np.array([(end.x_m, end.y_m) for end in ends]).T
    assert (np.abs(places - one.starts[:2]).max(axis=0) > 0.01).all()
    assert all(Arena().is_free(x, y, body_radius_m=0.2249) for x, y in places.T.tolist())


def test_the_peer_drives_the_same_drives() -> None:
    pytest.importorskip('irsim', reason='the extra bench is not installed')
    drives, peer = RandomDrives.draw(12, Arena(), np.random.default_rng(3)), IrSimDrives(Arena())
    gaps_m = []
    for index in range(12):
        end = drive_one(drives, index, Arena())
        peer.place(drives, index)
        x_m, y_m, _ = peer.drive(drives, index)
        gaps_m.append(np.hypot(x_m - end.x_m, y_m - end.y_m))
    assert np.median(gaps_m) < 0.05
