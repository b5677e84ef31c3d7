"""Localization through lenses of every distortion model, and in images of any size."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from goalreach_lab.localization.frame_log import pose_error, pose_nees
from led_arena import Drive

INCH_M = 0.0254
WIDE = {'horizontal_fov_rad': math.radians(90)}
RATIONAL = (1.2, 0.3, 0.001, -0.002, 0.01, 1.5, 0.5, 0.05)


@pytest.mark.parametrize(
    'robot',
    [
        {'distortion': (-0.25, 0.08, 0.001, -0.001, 0.0)},
        {'distortion_model': 'rational_polynomial', 'distortion': RATIONAL},
        {**WIDE, 'distortion_model': 'equidistant', 'distortion': (-0.02, 0.01, -0.004, 0.001)},
        {'image_width_px': 320, 'image_height_px': 240},
        {'image_width_px': 1920, 'image_height_px': 1080},
    ],
    ids=['plumb_bob', 'rational_polynomial', 'equidistant', '320x240', '1920x1080'],
)
def test_drives_through_any_lens_stay_within_1_3_inches(robot: dict[str, Any]) -> None:
    positions: list[float] = []
    nees: list[float] = []
    for seed in range(3):
        for step in Drive(seed, robot=robot).run(300):
            if step.output.mode == 'tracking':
                truth, estimate = step.frame.truth.pose, step.output.estimate
                positions.append(math.hypot(*pose_error(estimate.pose, truth)[:2]) / INCH_M)
                nees.append(pose_nees(estimate, truth))
    assert len(positions) > 500
    assert np.percentile(positions, 95) <= 1.3
    assert 0.3 < float(np.mean(nees)) < 6.0
