import numpy as np
import pytest

from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_sim.sensors import RunErrors, draw_run_errors


def draw(noise: NoiseModel, seed: int) -> RunErrors:
    return draw_run_errors(noise, 3, np.random.default_rng(seed))


def test_a_perfect_machine_has_none() -> None:
    errors = draw(noise_preset('none'), 1)
    assert not errors.landmark_offsets_m.any()
    assert (errors.focal_scale, errors.odometry_scale) == (1.0, 1.0)
    biases = (
        errors.pan_bias_rad,
        errors.tilt_bias_rad,
        errors.drift_rad_per_m,
        errors.camera_height_m,
    )
    assert biases == (0.0, 0.0, 0.0, 0.0)


def test_harsh_is_twice_the_same_draw() -> None:
    nominal, harsh = draw(noise_preset('nominal'), 5), draw(noise_preset('harsh'), 5)
    assert harsh.pan_bias_rad == pytest.approx(2 * nominal.pan_bias_rad)
    assert harsh.odometry_scale - 1 == pytest.approx(2 * (nominal.odometry_scale - 1))
    assert harsh.landmark_offsets_m == pytest.approx(2 * nominal.landmark_offsets_m)


def test_spread_is_that_of_the_model() -> None:
    noise = NoiseModel()
    runs = [draw(noise, seed) for seed in range(800)]
    spread = {
        'pan': (np.std([e.pan_bias_rad for e in runs]), noise.pan_tilt_bias_rad),
        'tilt': (np.std([e.tilt_bias_rad for e in runs]), noise.pan_tilt_bias_rad),
        'height': (np.std([e.camera_height_m for e in runs]), noise.camera_height_error_m),
        'focal': (np.std([e.focal_scale for e in runs]), noise.focal_error),
        'scale': (np.std([e.odometry_scale for e in runs]), noise.odometry_scale_error),
        'drift': (np.std([e.drift_rad_per_m for e in runs]), noise.odometry_drift_rad_per_m),
        'survey': (np.std([e.landmark_offsets_m for e in runs]), noise.survey_error_m),
    }
    for measured, told in spread.values():
        assert measured == pytest.approx(told, rel=0.1)
