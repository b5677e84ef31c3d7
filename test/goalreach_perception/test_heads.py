"""Localization with heads of every kind: cameras that cannot turn to the landmarks."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

import numpy as np
import pytest

from goalreach_lab.localization.frame_log import pose_error, pose_nees
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.topics import HEAD_KINDS
from goalreach_msgs_py.values import HeadAngles, Odometry, Pose2, Twist2
from goalreach_perception.head_tracker import HeadConfig, HeadTracker
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_perception.measurement_model import Lens
from goalreach_sim.camera_renderer import CameraRenderer, true_lens
from goalreach_sim.camera_view import CameraPose, OpticsConfig
from goalreach_sim.sensors import draw_run_errors

CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3)
LENS = Lens.of_camera(CAMERA)
FIXED = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
PERIOD_S = 0.04
AROUND = (
    (0.6, 0.0, 1.5), (1.6, 0.0, 1.3), (2.9, 0.0, 1.6), (3.556, 1.6, 1.35),
    (3.556, 3.6, 1.5), (2.3, 5.08, 1.3), (0.8, 5.08, 1.5), (0.0, 2.8, 1.35),
)  # fmt: skip


class Cart:
    """A differential drive with a level, fixed camera, and nominal errors of construction."""

    def __init__(self, arena: Arena, seed: int, start: Pose2) -> None:
        noise, rng = NoiseModel(), np.random.default_rng([seed, 4])
        self._errors = draw_run_errors(noise, len(arena.landmarks_m), rng)
        self._renderer = CameraRenderer(
            true_lens(CAMERA, self._errors.focal_scale),
            np.array(arena.landmarks_m) + self._errors.landmark_offsets_m,
            (arena.width_m, arena.length_m),
            optics=OpticsConfig(),
            noise=noise,
            rng=rng,
            event_rng=rng,
        )
        self.localizer = LandmarkLocalizer(
            LocalizerConfig.for_arena(arena, noise), HEAD_KINDS['none']
        )
        self.truth, self._odometry, self._ticks = start, start, 0

    def step(self, speed_m_per_s: float, turn_rad_per_s: float) -> LocalizerOutput:
        """Drive for a period, then process an image."""
        distance, turn = speed_m_per_s * PERIOD_S, turn_rad_per_s * PERIOD_S
        self.truth = _moved(self.truth, distance, turn + self._errors.drift_rad_per_m * distance)
        self._odometry = _moved(self._odometry, self._errors.odometry_scale * distance, turn)
        self._ticks += 1
        pose = CameraPose(
            centre_m=np.array(
                [self.truth.x_m, self.truth.y_m, 1.1 + self._errors.camera_height_m]
            ),
            azimuth_rad=self.truth.heading_rad + self._errors.pan_bias_rad,
            tilt_rad=self._errors.tilt_bias_rad,
            velocity_m_per_s=np.zeros(3),
            azimuth_rad_per_s=0.0,
            tilt_rad_per_s=0.0,
        )
        twist = Twist2(linear_m_per_s=speed_m_per_s, steering_rad_per_s=turn_rad_per_s)
        return self.localizer.process(
            time_ns=round(self._ticks * PERIOD_S * 1e9),
            image=self._renderer.render(pose),
            camera=CAMERA,
            joints=FIXED,
            odometry=Odometry(pose=self._odometry, twist=twist),
        )


def _moved(pose: Pose2, distance_m: float, turn_rad: float) -> Pose2:
    between = pose.heading_rad + 0.5 * turn_rad
    return Pose2(
        x_m=pose.x_m + distance_m * math.cos(between),
        y_m=pose.y_m + distance_m * math.sin(between),
        heading_rad=math.remainder(pose.heading_rad + turn_rad, math.tau),
    )


@dataclass
class Blind:
    """The end of a time without any LED in view."""

    seen: int
    mode: str
    sigma_m: tuple[float, float]
    error_m: float
    nees: float


def drive_blindly(seed: int) -> Blind:
    """See the LEDs of the goal wall, turn away from them, and drive 2 m without."""
    cart = Cart(Arena(), seed, Pose2(x_m=1.778, y_m=2.3, heading_rad=-math.pi / 2))
    for _ in range(50):
        output = cart.step(0.0, 0.0)
    before = math.sqrt(output.estimate.covariance[:2, :2].trace())
    seen = 0
    for tick in range(400):  # 180 degrees in 3 s, then 2 m in 13 s
        output = cart.step(0.0 if tick < 75 else 0.154, math.pi / 3 if tick < 75 else 0.0)
        seen += tick > 75 and any(led is not None for led in output.landmarks)
    error_m = math.hypot(*pose_error(output.estimate.pose, cart.truth)[:2])
    after = math.sqrt(output.estimate.covariance[:2, :2].trace())
    nees = pose_nees(output.estimate, cart.truth)
    return Blind(int(seen), output.mode, (before, after), error_m, nees)


def test_a_fixed_camera_drives_on_odometry_with_a_covariance_that_grows_honestly() -> None:
    ends = [drive_blindly(seed) for seed in range(20)]
    assert all(end.seen == 0 for end in ends)
    ends = [end for end in ends if end.mode == 'tracking']
    assert len(ends) >= 16  # the others lost several LEDs at once as they turned away
    assert all(end.sigma_m[1] > 2.0 * end.sigma_m[0] for end in ends)
    assert 0.5 < float(np.mean([end.nees for end in ends])) < 6.0


def test_a_fixed_camera_among_eight_leds_finds_its_pose_and_keeps_it() -> None:
    arena = replace(Arena(), landmarks_m=AROUND)
    errors, most = [], 0
    for seed, heading in enumerate((-2.0, -0.5, 1.0, 2.5)):
        cart = Cart(arena, seed, Pose2(x_m=1.5, y_m=2.4, heading_rad=heading))
        outputs = [cart.step(0.0, 0.5) for _ in range(320)]  # once around
        assert any(output.mode == 'tracking' for output in outputs[-5:])
        for _ in range(100):
            output = cart.step(0.25, 0.5)
            if output.mode != 'tracking':
                continue
            errors.append(math.hypot(*pose_error(output.estimate.pose, cart.truth)[:2]))
            most = max(most, sum(led is not None for led in output.landmarks))
    assert most >= 3
    assert len(errors) >= 360
    assert np.percentile(errors, 95) < 0.033


def test_four_leds_in_one_image_are_no_ambiguity() -> None:
    rng = np.random.default_rng(0)
    x, z = np.sort(rng.uniform(0.3, 3.2, 4)), rng.uniform(1.3, 1.9, 4)
    y = [0.0, 0.3 * rng.random(), 0.0, 0.3 * rng.random()]
    arena = replace(Arena(), landmarks_m=tuple(zip(x.tolist(), y, z.tolist(), strict=True)))
    cart = Cart(arena, 0, Pose2(x_m=1.7, y_m=3.8, heading_rad=-1.6))
    outputs = [cart.step(0.0, 0.0) for _ in range(3)]
    assert outputs[-1].mode == 'tracking'


def test_a_head_without_a_turret_sweeps_from_end_to_end() -> None:
    tracker = HeadTracker(HeadConfig(), HEAD_KINDS['pan_tilt'])
    head, pans, tilts = FIXED, list[float](), set[float]()
    for _ in range(400):
        target = tracker.search(head)
        step = math.copysign(min(0.06, abs(target.pan_rad - head.pan_rad)), target.pan_rad)
        head = replace(head, pan_rad=head.pan_rad + step, tilt_rad=target.tilt_rad)
        pans.append(head.pan_rad)
        tilts.add(round(math.degrees(head.tilt_rad)))
    turns = np.flatnonzero(np.diff(np.sign(np.diff(pans))))
    assert len(turns) >= 5
    assert [max(pans), min(pans)] == pytest.approx([1.5, -1.5], abs=0.1)
    assert tilts == {20, 40}


def test_a_head_without_a_turret_looks_at_what_it_can_reach() -> None:
    offsets = [[-2.0, 0.5, 0.3], [-2.0, -0.5, 0.3], [0.5, 2.0, 0.3]]  # two behind the robot
    arguments = {'heading_rad': 0.0, 'offsets_m': offsets, 'biases_rad': (0.0, 0.0), 'lens': LENS}
    command = HeadTracker(HeadConfig(), HEAD_KINDS['pan']).track(FIXED, **arguments)  # type: ignore[arg-type]
    assert command.pan_rad == pytest.approx(math.atan2(2.0, 0.5), abs=1e-6)
    assert command.tilt_rad == 0.0


def test_of_many_leds_as_many_as_fit_are_centred() -> None:
    azimuths = np.radians([0.0, 20.0, 40.0, 100.0, 115.0, 180.0, 250.0, 300.0])
    offsets = [[3.0 * math.cos(a), 3.0 * math.sin(a), 0.4] for a in azimuths]
    azimuth, _ = HeadTracker(HeadConfig()).centre_leds(offsets, LENS)
    assert math.degrees(azimuth) == pytest.approx(20.0, abs=1.0)
