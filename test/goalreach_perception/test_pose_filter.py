from __future__ import annotations

from collections.abc import Callable
from itertools import permutations
import math

import numpy as np
import pytest

from goalreach_msgs_py.arena import ArenaConfig
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.detection import Spots
from goalreach_perception.image_delay import ImageMotion
from goalreach_perception.landmark_tracking import MatchedLeds, correct_by
from goalreach_perception.measurement_model import (
    DELAY,
    DRIFT,
    HEIGHT,
    LEDS,
    MOUNT,
    PAN_BIAS,
    SCALE,
    SLIP,
    Lens,
)
from goalreach_perception.measurement_prediction import innovation_distance2
from goalreach_perception.pose_filter import PoseFilter
from goalreach_perception.process_model import FilterConfig

LENS = Lens.of_camera(PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3))
JOINTS = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.1)
START = Pose2(x_m=1.7, y_m=3.0, heading_rad=-math.pi / 2)
ORIGIN = Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)
ALL = np.arange(3)


def started(
    *, calibrate: bool = False, sigma_m: float = 0.1, sigma_rad: float = 0.05
) -> PoseFilter:
    state = PoseFilter(
        FilterConfig(),
        NoiseModel(),
        leds_m=ArenaConfig().landmark_array_m,
        camera_height_m=1.1,
        calibrate=calibrate,
    )
    state.start(START, np.diag([sigma_m**2, sigma_m**2, sigma_rad**2]))
    return state


def seen_from(state: PoseFilter, offset_px: FloatArray | float = 0.0) -> FloatArray:
    return state.predict_leds(LENS, JOINTS).pixels_px + offset_px


def test_a_metre_straight_ahead_follows_the_map_heading() -> None:
    state = started()
    state.predict(ORIGIN, Pose2(x_m=1.0, y_m=0.0, heading_rad=0.0))
    assert state.pose.x_m == pytest.approx(1.7)
    assert state.pose.y_m == pytest.approx(2.0)
    assert state.pose.heading_rad == pytest.approx(-math.pi / 2)


def test_process_noise_of_a_metre() -> None:
    state = started(sigma_m=0.0, sigma_rad=0.02)
    state.predict(ORIGIN, Pose2(x_m=1.0, y_m=0.0, heading_rad=0.0))
    noise, config = NoiseModel(), FilterConfig()
    along = noise.odometry_scale_error**2 + config.slip_m_per_sqrt_m**2
    drift = noise.odometry_drift_rad_per_m
    across = 0.02**2 + (0.5 * drift) ** 2 + config.slip_m_per_sqrt_m**2
    heading = 0.02**2 + drift**2 + config.heading_walk_rad_per_sqrt_m**2
    assert state.covariance.diagonal()[:3] == pytest.approx([across, along, heading])


def test_a_base_that_turns_on_two_wheels_is_less_sure_of_its_heading() -> None:
    state, config = started(sigma_rad=0.02), FilterConfig(heading_walk_rad_per_sqrt_rad=0.03)
    unsure = PoseFilter(
        config,
        NoiseModel(),
        leds_m=ArenaConfig().landmark_array_m,
        camera_height_m=1.1,
        calibrate=False,
    )
    unsure.start(START, np.diag([0.01, 0.01, 0.02**2]))
    for one in (state, unsure):
        one.predict(ORIGIN, Pose2(x_m=0.0, y_m=0.0, heading_rad=0.5))
    assert state.covariance[2, 2] == pytest.approx(0.02**2)
    assert unsure.covariance[2, 2] == pytest.approx(0.02**2 + 0.03**2 * 0.5)


def test_known_scale_and_drift_correct_the_odometry() -> None:
    state = started()
    state.mean[SCALE], state.mean[DRIFT] = 0.02, 0.1
    state.predict(ORIGIN, Pose2(x_m=0.01, y_m=0.0, heading_rad=0.0))
    assert state.pose.y_m == pytest.approx(3.0 - 0.0102, abs=1e-7)
    assert state.pose.heading_rad == pytest.approx(-math.pi / 2 + 0.001)


def test_turning_on_the_spot_adds_no_uncertainty() -> None:
    state = started()
    before = state.covariance.copy()
    state.predict(ORIGIN, Pose2(x_m=0.0, y_m=0.0, heading_rad=3.0))
    assert state.pose.heading_rad == pytest.approx(3.0 - math.pi / 2)
    assert np.array_equal(state.covariance, before)


def test_predicted_pixels_leave_the_mean_and_shrink_the_covariance() -> None:
    state = started()
    before = state.mean.copy(), np.trace(state.covariance[:2, :2])
    distance2 = state.correct(
        state.predict_leds(LENS, JOINTS), ALL, seen_from(state), np.full(3, 0.1)
    )
    assert distance2 == pytest.approx(0.0, abs=1e-12)
    assert state.mean == pytest.approx(before[0])
    assert np.trace(state.covariance[:2, :2]) < 0.05 * before[1]


def test_a_wrong_pose_is_corrected_by_the_pixels_of_the_true_one() -> None:
    truth = started()
    seen = seen_from(truth)
    state = started(sigma_m=0.3, sigma_rad=0.1)
    state.mean[:3] += [0.05, -0.04, 0.02]
    for _ in range(5):
        state.correct(state.predict_leds(LENS, JOINTS), ALL, seen, np.full(3, 0.1))
    assert state.mean[:2] == pytest.approx([1.7, 3.0], abs=0.01)
    assert state.mean[2] + state.mean[PAN_BIAS] == pytest.approx(-math.pi / 2, abs=0.005)


def test_considered_states_are_never_corrected_but_keep_their_uncertainty() -> None:
    state = started()
    constants = slice(HEIGHT, SLIP)
    mean, block = state.mean[constants].copy(), state.covariance[constants, constants].copy()
    for _ in range(200):
        pixels = seen_from(state, np.array([0.3, -0.2]))
        state.correct(state.predict_leds(LENS, JOINTS), ALL, pixels, np.full(3, 0.05))
    assert np.array_equal(state.mean[constants], mean)
    assert state.covariance[constants, constants] == pytest.approx(block)
    # However many images there are, the survey's error of 0.1 in stays in the position.
    assert state.covariance[0, 0] > (0.5 * NoiseModel().survey_error_m) ** 2


def test_calibration_learns_what_considering_does_not() -> None:
    taught, considering = started(calibrate=True), started()
    for state in (taught, considering):
        for x_m in np.linspace(-0.5, 0.5, 20):
            state.start(Pose2(x_m=1.7 + x_m, y_m=2.5, heading_rad=-1.57), 1e-4 * np.eye(3))
            state.correct(
                state.predict_leds(LENS, JOINTS), ALL, seen_from(state), np.full(3, 0.05)
            )
    learnt = taught.covariance.diagonal()[HEIGHT:SLIP]
    assert (learnt < considering.covariance.diagonal()[HEIGHT:SLIP]).all()


def test_pixels_outside_the_gate_change_nothing() -> None:
    state = started()
    before = state.mean.copy(), state.covariance.copy()
    pixels = seen_from(state)
    pixels[0] += 400.0
    assert state.correct(state.predict_leds(LENS, JOINTS), ALL, pixels, np.full(3, 0.1)) > 32.0
    assert np.array_equal(state.mean, before[0])
    assert np.array_equal(state.covariance, before[1])


def test_the_order_of_the_leds_does_not_matter() -> None:
    results = []
    for order in permutations(range(3)):
        state = started()
        pixels = seen_from(state, np.array([1.0, 0.5]))
        leds = np.array(order)
        state.correct(state.predict_leds(LENS, JOINTS), leds, pixels[leds], np.full(3, 0.1))
        results.append((state.mean, state.covariance))
    for mean, covariance in results[1:]:
        assert mean == pytest.approx(results[0][0], abs=1e-12)
        assert covariance == pytest.approx(results[0][1], abs=1e-14)


def test_the_covariance_stays_symmetric_and_positive() -> None:
    state = started(calibrate=True)
    rng = np.random.default_rng(0)
    place = ORIGIN
    for k in range(300):
        following = Pose2(x_m=0.01 * k, y_m=0.0, heading_rad=0.01 * k)
        state.predict(place, following)
        place = following
        leds = np.sort(rng.permutation(3)[: rng.integers(1, 4)])
        prediction = state.predict_leds(LENS, JOINTS)
        noisy = prediction.pixels_px[leds] + 0.1 * rng.standard_normal((len(leds), 2))
        state.correct(prediction, leds, noisy, np.full(len(leds), 0.1))
    assert np.array_equal(state.covariance, state.covariance.T)
    assert np.linalg.eigvalsh(state.covariance).min() > -1e-12


def test_pan_noise_is_common_to_the_leds_of_an_image() -> None:
    # A shift of all pixels like that of a pan error is likelier than one of a single LED.
    state = started(sigma_m=1e-4, sigma_rad=1e-4)
    prediction = state.predict_leds(LENS, JOINTS)
    sigmas = np.full(3, 0.05)
    together = prediction.pixels_px + np.array([0.5, 0.0])
    alone = prediction.pixels_px.copy()
    alone[0, 0] += 0.5
    common = innovation_distance2(prediction, ALL, together, sigmas)
    assert common < 0.5 * innovation_distance2(prediction, ALL, alone, sigmas)


def test_a_new_start_keeps_the_biases_and_drops_their_correlation_with_the_pose() -> None:
    state = started()
    state.correct(state.predict_leds(LENS, JOINTS), ALL, seen_from(state, 0.5), np.full(3, 0.1))
    bias, variance = state.mean[PAN_BIAS], state.covariance[PAN_BIAS, PAN_BIAS]
    state.start(ORIGIN, np.eye(3))
    assert (state.mean[PAN_BIAS], state.covariance[PAN_BIAS, PAN_BIAS]) == (bias, variance)
    assert not state.covariance[:3, 3:].any()


def test_calibration_fades_to_the_prior() -> None:
    state = started(calibrate=True)
    prior = state.covariance.diagonal()[PAN_BIAS:].copy()
    for _ in range(20):
        pixels = seen_from(state, np.array([0.3, -0.2]))
        state.correct(state.predict_leds(LENS, JOINTS), ALL, pixels, np.full(3, 0.05))
    learnt = state.mean.copy()
    memory_s = FilterConfig().memory_s
    state.fade(memory_s * math.log(2.0))
    assert state.mean[PAN_BIAS] == pytest.approx(0.5 * learnt[PAN_BIAS])
    assert state.mean[:3] == pytest.approx(learnt[:3])
    state.fade(50.0 * memory_s)
    assert state.mean[LEDS:MOUNT] == pytest.approx(ArenaConfig().landmark_array_m.reshape(-1))
    assert state.covariance.diagonal()[PAN_BIAS:] == pytest.approx(prior)


def test_considered_states_do_not_fade() -> None:
    state = started()
    before = state.covariance[HEIGHT:SLIP, HEIGHT:SLIP].copy()
    state.fade(100.0)
    assert np.array_equal(state.covariance[HEIGHT:SLIP, HEIGHT:SLIP], before)


@pytest.mark.parametrize('larger', [False, True])
def test_rotation_and_scale_of_robot_and_leds_are_unobservable(*, larger: bool) -> None:
    # A rotation by d about the origin moves a position by (-y, x) d and a heading by d; a change
    # of scale by d moves a position by (x, y, z) d, camera height and odometry scale included.
    # Images of a driving robot must not increase the information in that direction.
    state = started(sigma_m=0.05, sigma_rad=0.05, calibrate=True)
    rng = np.random.default_rng(3)
    surveyed_m = ArenaConfig().landmark_array_m

    def known() -> float:
        direction = np.zeros(LEDS + 14)
        predicted = state._motion._predicted_m
        if larger:
            direction[[0, 1, SCALE, HEIGHT]] = *predicted, 1.0, 1.1
            direction[LEDS:MOUNT] = surveyed_m.reshape(-1)
        else:
            direction[[0, 1, 2]] = -predicted[1], predicted[0], 1.0
            direction[LEDS:MOUNT:3], direction[LEDS + 1 : MOUNT : 3] = (
                -surveyed_m[:, 1],
                surveyed_m[:, 0],
            )
        return float(direction @ np.linalg.solve(state.covariance, direction))

    state.predict(ORIGIN, ORIGIN)
    begin = known()
    for step in range(40):
        here, there = (Pose2(x_m=0.02 * k, y_m=0.0, heading_rad=0.0) for k in (step, step + 1))
        pixels = seen_from(state) + 0.3 * rng.standard_normal((3, 2))
        state.correct(state.predict_leds(LENS, JOINTS), ALL, pixels, np.full(3, 0.1))
        state.predict(here, there)
    assert known() <= begin * (1.0 + 1e-6)


def test_a_coarse_start_inflates_the_covariance() -> None:
    state = started()
    sure = state.pose_covariance
    state.start(START, state.covariance[:3, :3].copy(), coarse=True)
    unconfirmed_m2 = np.diag([0.045**2, 0.045**2, 0.0])
    wider = np.diag([1.0, 1.0, 1.3])
    assert state.pose_covariance == pytest.approx(wider @ sure @ wider + unconfirmed_m2)


def test_restore_discards_the_corrections_since_a_coarse_start() -> None:
    state = started(calibrate=True)
    before = state.mean[PAN_BIAS:].copy(), state.covariance[PAN_BIAS:, PAN_BIAS:].copy()
    state.correct(state.predict_leds(LENS, JOINTS), ALL, seen_from(state, 0.8), np.full(3, 0.1))
    assert state.mean[PAN_BIAS:] != pytest.approx(before[0], abs=1e-9)
    state.restore()
    assert state.mean[PAN_BIAS:] == pytest.approx(before[0])
    assert state.covariance[PAN_BIAS:, PAN_BIAS:] == pytest.approx(before[1])


def contradict(state: PoseFilter, enough: Callable[[], bool]) -> None:
    """Show images of two LEDs, one of them far off to either side in turn."""
    wrong = np.array([[0.0, 0.0], [60.0, 0.0], [0.0, 0.0]])
    for image in range(200):
        if enough():
            return
        seen = seen_from(state, wrong * (-1) ** image)
        state.correct(state.predict_leds(LENS, JOINTS), ALL[:2], seen[:2], np.full(2, 0.1))
    pytest.fail('200 images were not enough')


def test_images_refute_a_coarse_pose_and_what_they_told_of_constants_is_forgotten() -> None:
    state = started(calibrate=True)
    state.start(START, np.diag([0.01, 0.01, 0.0025]), coarse=True)
    prior = state.mean[LEDS:MOUNT].copy(), state.covariance[HEIGHT:, HEIGHT:].copy()
    contradict(state, lambda: state.is_refuted)
    assert state.misfit
    state.reset()
    assert not state.is_refuted
    assert not state.misfit
    assert state.mean[LEDS:MOUNT] == pytest.approx(prior[0])
    assert state.covariance[HEIGHT:, HEIGHT:] == pytest.approx(prior[1])
    state.start(START, np.diag([0.01, 0.01, 0.0025]))
    assert not state.is_refuted


def test_a_doubt_and_the_growth_of_a_misfit_fade_while_images_fit() -> None:
    state = started(calibrate=True)
    contradict(state, lambda: bool(state.misfit))
    state.doubt = 1.0
    doubted = state.pose_covariance - state.covariance[:3, :3]
    assert doubted[0, 0] > 0.04**2
    memory_s = FilterConfig().memory_s
    state.fade(memory_s)
    assert state.misfit
    assert state.doubt == pytest.approx(math.exp(-1.0))
    for _ in range(9):
        state.fade(memory_s)
    assert not state.misfit
    assert state.pose_covariance == pytest.approx(state.covariance[:3, :3], abs=1e-9)


def test_a_model_that_did_not_fit_refutes_no_later_pose_and_is_not_forgotten_with_one() -> None:
    state = started(calibrate=True)
    contradict(state, lambda: state._memory.growth > 20.0)
    grown, misfit = state._memory.growth, state.misfit
    state.fade(np.inf)
    prior = state.covariance[HEIGHT:, HEIGHT:].copy()
    state.start(START, np.diag([0.01, 0.01, 0.0025]), coarse=True)
    assert not state.is_refuted
    contradict(state, lambda: state.is_refuted)
    assert state._memory.growth > 9.0 * grown
    state.reset()
    assert state.misfit == misfit
    assert state.covariance[HEIGHT:, HEIGHT:] == pytest.approx(prior)


def test_what_contradicts_a_coarse_pose_is_no_misfit_once_a_better_one_is_known() -> None:
    state = started(calibrate=True)
    state.fade(np.inf)
    prior = state.covariance[HEIGHT:, HEIGHT:].copy()
    state.start(START, np.diag([0.01, 0.01, 0.0025]), coarse=True)
    contradict(state, lambda: bool(state.misfit))
    contradict(state, lambda: state._watch._freedom > 20.0)  # half way to the next growth
    state.restore()
    state.start(START, np.diag([1e-4, 1e-4, 1e-6]))
    assert not state.misfit
    for _ in range(10):
        seen = seen_from(state)
        state.correct(state.predict_leds(LENS, JOINTS), ALL, seen, np.full(3, 0.1))
    assert not state.misfit
    state.fade(np.inf)
    assert state.covariance[HEIGHT:, HEIGHT:] == pytest.approx(prior)


def test_a_survey_that_does_not_fit_makes_the_position_much_less_certain() -> None:
    state, noise = started(calibrate=True), NoiseModel()
    sure = state.pose_covariance
    state.mean[HEIGHT] = 3.4 * noise.camera_height_error_m
    state.fade(1.0)
    assert not state.misfit
    state.mean[LEDS + 5] += 3.7 * noise.survey_error_m
    state.fade(1.0)
    assert 'z of LED 1 in landmarks_m first' in state.misfit
    assert state.pose_covariance[0, 0] == pytest.approx(sure[0, 0] + 0.1**2)


def test_a_height_that_does_not_fit_makes_the_position_less_certain() -> None:
    state, noise = started(calibrate=True), NoiseModel()
    sure = state.pose_covariance
    state.mean[HEIGHT] = 4.1 * noise.camera_height_error_m
    state.fade(1.0)
    assert 'camera_height_m first' in state.misfit
    assert state.pose_covariance[0, 0] == pytest.approx(sure[0, 0] + 0.03**2)
    state.mean[SLIP] = 6.0 * FilterConfig().slip_sigma_s
    state.fade(1.0)
    assert 'wheel slip first' in state.misfit


def test_growth_of_considered_constants_is_undone() -> None:
    state = started(calibrate=False)
    prior = state.covariance[HEIGHT:, HEIGHT:].copy()
    for _ in range(3):
        for _ in range(10):
            seen = seen_from(state, 300.0)
            state.correct(state.predict_leds(LENS, JOINTS), ALL, seen, np.full(3, 0.1))
        assert not state.fits
        state.reset()
        state.start(START, np.diag([0.01, 0.01, 0.0025]))
    assert state.covariance[HEIGHT:, HEIGHT:] == pytest.approx(prior)


def test_an_led_that_is_elsewhere_is_left_out_of_three_and_not_of_two() -> None:
    state = started(sigma_m=1e-3, sigma_rad=1e-3)
    prediction = state.predict_leds(LENS, JOINTS)
    pixels_px = prediction.pixels_px + np.array([[0.0], [20.0], [0.0]])
    found = MatchedLeds(ALL, Spots.unknown(3), pixels_px, 3)
    assert correct_by(state, prediction, found.select([0, 1]), 3) is None
    used = correct_by(state, prediction, found, 3)
    assert used is not None
    assert used.leds.tolist() == [0, 2]


def of_mount(mount_m: tuple[float, float], delay_s: float | None = None) -> PoseFilter:
    leds_m, options = ArenaConfig().landmark_array_m, {'calibrate': True, 'camera_height_m': 1.1}
    known = {'leds_m': leds_m, 'mount_m': mount_m, 'delay_s': delay_s}
    return PoseFilter(FilterConfig(), NoiseModel(), **known, **options)  # type: ignore[arg-type]


def test_what_is_learnt_of_the_mount_adds_to_what_was_given() -> None:
    given, learnt = of_mount((0.12, 0.05)), of_mount((0.1, 0.02))
    learnt.mean[MOUNT:SLIP] = 0.02, 0.03
    for state in (given, learnt):
        state.start(START, np.eye(3))
    assert learnt.mount_m == pytest.approx((0.12, 0.05))
    assert seen_from(learnt) == pytest.approx(seen_from(given))


def test_a_delay_of_images_is_kept_when_all_else_is_forgotten() -> None:
    state = of_mount((0.0, 0.0), delay_s=0.02)
    state.motion = ImageMotion(0.02, turn_rad_per_s=(-0.5, 0.0))
    assert state.delay == pytest.approx((0.02, 0.02, 0.075))
    assert state.late_rad == pytest.approx(-0.5 * 0.075)
    rest = np.delete(np.delete(state.covariance, DELAY, axis=0), DELAY, axis=1)
    assert np.array_equal(state.surveyed_covariance, rest)
    state.fade(2.0)
    assert state.covariance[DELAY, DELAY] == pytest.approx(0.075**2 + 0.0005**2 * 2.0, rel=1e-9)
    state.mean[[DELAY, PAN_BIAS]], state.covariance[DELAY, DELAY] = 0.06, 1e-6
    state.forget_all_but_delay()
    assert state.delay == pytest.approx((0.02, 0.06, 0.001))
    assert state.mean[PAN_BIAS] == 0.0
