import numpy as np
import pytest

from goalreach_sim.head import PanTiltHead, Servo
from goalreach_sim.simulator_config import HeadConfig


def make_head(noise_rad: float) -> PanTiltHead:
    config = HeadConfig(rate_rad_per_s=1.0)
    return PanTiltHead(
        config,
        noise_rad=noise_rad,
        pan_bias_rad=0.01,
        tilt_bias_rad=-0.02,
        rng=np.random.default_rng(3),
    )


def test_true_angles_differ_from_the_encoders_by_the_bias() -> None:
    head = make_head(0.0)
    head.go_to(0.5, 0.25)
    head.advance(0.3)
    assert head.read() == pytest.approx((0.3, 0.25), abs=1e-15)
    assert head.true_angles_rad == pytest.approx((0.31, 0.23), abs=1e-15)


def test_ranges_of_the_paper() -> None:
    head = make_head(0.0)
    head.go_to(9.0, 9.0)
    head.advance(100.0)
    assert head.read() == pytest.approx((np.radians(87), np.radians(50)))
    head.go_to(-9.0, -9.0)
    head.advance(100.0)
    assert head.read() == pytest.approx((np.radians(-87), np.radians(-20)))


def test_reading_noise_matches_its_deviation() -> None:
    head = make_head(0.001)
    head.go_to(0.2, 0.1)
    head.advance(10.0)
    readings = np.array([head.read() for _ in range(4000)])
    assert readings.mean(axis=0) == pytest.approx([0.2, 0.1], abs=1e-4)
    assert readings.std(axis=0) == pytest.approx([0.001, 0.001], rel=0.06)


def test_place_zeroes_both_angles() -> None:
    head = make_head(0.0)
    head.go_to(0.5, 0.25)
    head.advance(0.3)
    head.place()
    head.advance(1.0)
    assert head.read() == (0.0, 0.0)


def make_servo() -> Servo:
    return Servo(minimum_rad=-1.0, maximum_rad=2.0, rate_rad_per_s=0.5)


def test_turns_at_its_rate_and_stops_at_the_target() -> None:
    servo = make_servo()
    servo.go_to(1.0)
    servo.advance(0.6)
    assert servo.position_rad == pytest.approx(0.3, abs=1e-15)
    assert servo.velocity_rad_per_s == 0.5
    servo.advance(10.0)
    assert servo.position_rad == 1.0
    assert servo.velocity_rad_per_s == 0.0


def test_keeps_to_its_range() -> None:
    servo = make_servo()
    servo.go_to(-7.0)
    servo.advance(100.0)
    assert servo.position_rad == -1.0
    servo.go_to(7.0)
    servo.advance(100.0)
    assert servo.position_rad == 2.0


def test_place_forgets_the_target() -> None:
    servo = make_servo()
    servo.go_to(1.0)
    servo.place(0.25)
    servo.advance(1.0)
    assert servo.position_rad == 0.25
