"""What is wrong with one robot and one set-up, drawn once per run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import FloatArray

__all__ = ['RunErrors', 'draw_run_errors']


@dataclass(frozen=True, kw_only=True, eq=False)
class RunErrors:
    """The errors of one run.

    Attributes:
        landmark_offsets_m: (n, 3), where the LEDs are minus where the survey says.
        camera_height_m: True height of the camera minus the nominal one.
        focal_scale: True focal length over the calibrated one.
        pan_bias_rad: True pan angle minus what its encoder reads.
        tilt_bias_rad: The same for tilt.
        odometry_scale: Distance by the encoders over distance driven.
        drift_rad_per_m: Turn of the base per metre driven, unseen by the encoders.
    """

    landmark_offsets_m: FloatArray
    camera_height_m: float
    focal_scale: float
    pan_bias_rad: float
    tilt_bias_rad: float
    odometry_scale: float
    drift_rad_per_m: float


def draw_run_errors(noise: NoiseModel, landmarks: int, rng: np.random.Generator) -> RunErrors:
    """Draw the errors of one run, each normal with the standard deviation of the model.

    Args:
        noise: How large they may be.
        landmarks: Number of LEDs.
        rng: Where they are drawn from; always the same number of draws.
    """
    height, focal, pan, tilt, scale, drift = rng.standard_normal(6).tolist()
    return RunErrors(
        landmark_offsets_m=noise.survey_error_m * rng.standard_normal((landmarks, 3)),
        camera_height_m=noise.camera_height_error_m * height,
        focal_scale=1.0 + noise.focal_error * focal,
        pan_bias_rad=noise.pan_tilt_bias_rad * pan,
        tilt_bias_rad=noise.pan_tilt_bias_rad * tilt,
        odometry_scale=1.0 + noise.odometry_scale_error * scale,
        drift_rad_per_m=noise.odometry_drift_rad_per_m * drift,
    )
