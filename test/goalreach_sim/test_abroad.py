"""What other people's rooms and robots have: light, exposure, lens, slip, clocks."""

from __future__ import annotations

from dataclasses import fields, replace
import math

import numpy as np
import pytest

from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.values import HeadAngles, Twist2
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatedFaults, SimulatorConfig

PERFECT = replace(noise_preset('none'), spot_sigma_px=1.2)
START = (1.778, 3.6, -math.pi / 2)


def simulator(**noise: float) -> Simulator:
    config = SimulatorConfig(noise=replace(PERFECT, **noise), start_pose=START)
    return Simulator(config, np.random.default_rng(1))


def test_all_of_it_is_off_unless_asked_for() -> None:
    added = {f.name for f in fields(NoiseModel) if getattr(NoiseModel(), f.name) == 0.0}
    assert added == {
        'ambient_dn',
        'texture',
        'exposure_s',
        'lens_offset_m',
        'level_error_rad',
        'side_slip_s',
        'sample_rate_hz',
        'image_delay_s',
    }
    abroad = noise_preset('abroad')
    assert all(getattr(abroad, name) > 0.0 for name in added - {'image_delay_s'})
    assert replace(abroad, **dict.fromkeys(added, 0.0)) == NoiseModel()


def test_walls_have_their_grey_value_and_turn_with_the_camera() -> None:
    one = simulator(ambient_dn=60.0, texture=0.2)
    image = one.sense().image.astype(float)
    assert image[:100].mean() == pytest.approx(70.0, abs=15.0)  # 10 is dark
    assert image[:100].std() > 5.0
    one.robot.base_yaw_rad += 100.0 / one.config.calibrated_camera.fx_px
    turned = one.sense().image.astype(float)
    same = np.abs(turned[:60, 100:] - image[:60, :-100]) < 1.0  # the LEDs are further down
    assert same.mean() > 0.99


def test_an_exposure_makes_a_streak_around_its_middle() -> None:
    sharp, smeared = simulator(), simulator(exposure_s=0.02)
    moments = []
    for one in (sharp, smeared):
        one.faults = SimulatedFaults(dark_leds=(1.0, 2.0))
        for _ in range(25):
            one.robot.feed_watchdog()
            one.robot.turret.go(0.5)
            one.advance()
        light = one.sense().image.astype(float) - 10.0
        flux, columns = light.sum(), np.arange(640)
        centre = light.sum(0) @ columns / flux
        width = math.sqrt(light.sum(0) @ (columns - centre) ** 2 / flux)
        moments.append((flux, centre, width))
    (flux, centre, width), (smeared_flux, smeared_centre, smeared_width) = moments
    assert smeared_flux == pytest.approx(flux, rel=0.05)
    assert smeared_centre == pytest.approx(centre, abs=0.15)
    focal_px = sharp.config.calibrated_camera.fx_px
    streak_px = 0.02 * 0.5 * focal_px * (1.0 + ((centre - 319.5) / focal_px) ** 2)
    assert math.sqrt(smeared_width**2 - width**2) == pytest.approx(streak_px / math.sqrt(12), 0.15)


def test_a_lens_in_front_of_the_axis_sees_from_there() -> None:
    ahead = simulator(lens_offset_m=0.1)
    moved = simulator()
    moved.reset(replace(moved.config.start, y_m=START[1] - 0.1))
    assert (ahead.sense().image == moved.sense().image).mean() > 0.999


def test_tyres_slip_out_of_a_bend() -> None:
    grip, slips = simulator(), simulator(side_slip_s=0.02)
    for one in (grip, slips):
        for _ in range(100):
            one.command_drive(Twist2(linear_m_per_s=0.3, steering_rad_per_s=0.6))
            one.advance()
    assert slips.robot.odometry == grip.robot.odometry
    # In the steady bend 0.02 s * 0.3 m/s * 0.6 rad/s = 3.6 mm/s, to the right.
    gaps = []
    for _ in range(2):
        gaps.append((slips.robot.x_m - grip.robot.x_m, slips.robot.y_m - grip.robot.y_m))
        heading = grip.robot.heading_rad
        grip.advance()
        slips.advance()
    aside = np.subtract(gaps[1], gaps[0]) @ (math.sin(heading), -math.cos(heading))
    assert aside == pytest.approx(0.0036 * 0.04, rel=0.02)


def test_clocks_of_their_own_give_what_lies_between_two_samples() -> None:
    one, exact = simulator(sample_rate_hz=100.0), simulator()
    stamps = []
    for _ in range(50):
        for each in (one, exact):
            each.command_drive(Twist2(linear_m_per_s=0.3, steering_rad_per_s=0.5))
            each.command_head(HeadAngles(turret_rad=0.3, pan_rad=0.2, tilt_rad=0.1))
            each.advance()
        frame = one.sense()
        stamps.append(frame.time_ns)
        pose, truth = frame.odometry.pose, frame.truth.pose
        assert math.hypot(pose.x_m - truth.x_m, pose.y_m - truth.y_m) < 0.0005
        assert frame.joints.turret_rad == pytest.approx(frame.truth_head.turret_rad, abs=0.002)
    assert np.diff(stamps).tolist() == [40_000_000] * 49
    assert stamps[0] == 20_000_000  # two periods of 10 ms late
    assert one.sense().odometry.pose != one.sense().truth.pose


@pytest.mark.parametrize('late_s', [0.04, 0.08])
def test_a_late_image_shows_what_was_there_before_its_stamp(late_s: float) -> None:
    late, exact = (simulator(sample_rate_hz=100.0, image_delay_s=s) for s in (late_s, 0.0))
    columns: dict[int, int] = {}
    turrets_rad: dict[int, float] = {}
    for _ in range(12):
        for each in (late, exact):
            each.robot.turret.go(0.5)
            each.advance()
        true = exact.sense()
        columns[true.time_ns] = int(true.image.max(axis=0).argmax())
        turrets_rad[true.time_ns] = true.truth_head.turret_rad
    frame, exposed_ns = late.sense(), late.time_ns - round(late_s * 1e9)
    assert int(frame.image.max(axis=0).argmax()) == columns[exposed_ns]
    assert columns[late.time_ns] > columns[exposed_ns] + 3
    assert frame.truth_head.turret_rad == pytest.approx(turrets_rad[frame.time_ns])
    assert late.sampled is not None
    (now, odometry), (before, _) = (late.sampled(t) for t in (frame.time_ns, exposed_ns))
    assert (now, odometry) == (frame.joints, frame.odometry)
    assert before.turret_rad == pytest.approx(turrets_rad[exposed_ns], abs=1e-3)


@pytest.mark.parametrize(
    ('rate_hz', 'late_s'), [(100.0, 0.0), (50.0, 0.0), (10.0, 0.0), (100.0, 0.1)]
)
def test_sensors_of_a_robot_just_placed_are_those_of_its_place(
    rate_hz: float, late_s: float
) -> None:
    one = simulator(sample_rate_hz=rate_hz, image_delay_s=late_s)
    for number in range(10):
        one.reset(replace(one.config.start, x_m=1.0 + number % 2))
        place = one.robot.odometry.pose
        for _ in range(5):
            one.advance()
            frame = one.sense()
            assert one.sampled is not None
            joints, odometry = one.sampled(frame.time_ns - round(late_s * 1e9))
            assert frame.odometry.pose == odometry.pose == place
            assert joints.turret_rad == pytest.approx(frame.truth_head.turret_rad)
        one.robot.turret.go(0.5)
        one.advance()
