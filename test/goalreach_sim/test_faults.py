"""Faults switched on at run time."""

from dataclasses import replace
import math

import numpy as np
import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.parameters import build_config
from goalreach_msgs_py.values import Pose2, Twist2
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatedFaults, SimulatorConfig


@pytest.fixture
def simulator() -> Simulator:
    """Return a robot in the middle, its head towards the LEDs, without noise."""
    config = SimulatorConfig(noise=noise_preset('none'))
    return Simulator(config, np.random.default_rng(0))


def bright(simulator: Simulator) -> int:
    """Return the number of pixels brighter than the noise."""
    return int((simulator.sense().image > 60).sum())


def test_leds_fail_and_recover(simulator: Simulator) -> None:
    lit = bright(simulator)
    simulator.faults = SimulatedFaults(dark_leds=(1.0,))
    assert 0 < bright(simulator) < lit
    simulator.faults = SimulatedFaults(dark_leds=(0.0, 1.0, 2.0))
    assert bright(simulator) == 0
    simulator.faults = SimulatedFaults()
    assert bright(simulator) == lit


def test_a_false_light_is_seen(simulator: Simulator) -> None:
    lit = bright(simulator)
    simulator.faults = SimulatedFaults(extra_light_m=(1.2, 1.0, 1.3))
    assert bright(simulator) > lit


def test_frozen_encoders_resume_from_their_reading(simulator: Simulator) -> None:
    simulator.faults = SimulatedFaults(odometry_frozen=True)
    before = simulator.sense()
    for _ in range(20):
        simulator.command_drive(Twist2(linear_m_per_s=0.5, steering_rad_per_s=0.0))
        simulator.advance()
    frozen = simulator.sense()
    assert frozen.odometry.pose == before.odometry.pose
    assert frozen.truth.pose.y_m < before.truth.pose.y_m - 0.1
    simulator.faults = SimulatedFaults()
    thawed = simulator.sense()
    assert thawed.odometry.pose.y_m == pytest.approx(frozen.odometry.pose.y_m, abs=1e-9)


def test_a_frozen_camera_repeats_its_image(simulator: Simulator) -> None:
    first = simulator.sense().image
    simulator.faults = SimulatedFaults(camera_frozen=True)
    for _ in range(20):
        simulator.command_drive(Twist2(linear_m_per_s=0.5, steering_rad_per_s=0.0))
        simulator.advance()
    assert np.array_equal(simulator.sense().image, first)


def test_a_stuck_bumper_stays_pressed(simulator: Simulator) -> None:
    simulator.faults = SimulatedFaults(stuck_bumper=7)
    assert [i for i, pressed in enumerate(simulator.sense().bumpers) if pressed] == [7]


def test_a_carried_robot_moves_unnoticed_by_its_encoders(simulator: Simulator) -> None:
    before = simulator.sense()
    simulator.faults = SimulatedFaults(carry_to=(1.0, 3.0, 0.5))
    after = simulator.sense()
    pose = after.truth.pose
    assert (pose.x_m, pose.y_m, pose.heading_rad) == pytest.approx((1.0, 3.0, 0.5))
    assert after.odometry.pose == before.odometry.pose


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('dark_leds', (0.5,)),
        ('extra_light_m', (1.0, 2.0)),
        ('carry_to', (1.0, math.nan, 0.0)),
        ('stuck_bumper', 20),
    ],
)
def test_invalid_faults_are_refused(name: str, value: object) -> None:
    with pytest.raises(ConfigurationError, match=name):
        build_config(SimulatedFaults, {name: value})


def test_a_reset_defines_where_frozen_encoders_count_from(simulator: Simulator) -> None:
    simulator.faults = SimulatedFaults(odometry_frozen=True)
    start = Pose2(x_m=1.0, y_m=4.0, heading_rad=-1.5)
    simulator.reset(start)
    assert simulator.sense().odometry.pose == start
    simulator.command_drive(Twist2(linear_m_per_s=0.5, steering_rad_per_s=0.0))
    simulator.advance()
    assert simulator.sense().odometry.pose == start


def test_a_robot_is_carried_again_once_that_fault_was_cleared(simulator: Simulator) -> None:
    there, none = SimulatedFaults(carry_to=(1.0, 3.0, 0.5)), SimulatedFaults()
    still = replace(there, stuck_bumper=3)
    for faults, y_m in ((there, 3.0), (still, 4.0), (none, 4.0), (there, 3.0)):
        simulator.robot.y_m = 4.0
        simulator.faults = faults
        assert simulator.robot.y_m == y_m
