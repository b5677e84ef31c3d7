import pytest

from goalreach_sim.head import Servo


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
