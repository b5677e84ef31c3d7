"""Random drives find no flaw in the physics."""

import numpy as np

from random_flaws import study_drives


def test_random_drives_find_no_flaw() -> None:
    study = study_drives(400, np.random.default_rng(2))
    assert study.drives == 400
    assert study.bumps > 100
    assert study.overlap_m <= 1e-6
    assert study.speed_excess <= 1e-9
    assert study.acceleration_excess <= 1e-9
    assert study.odometry_error_m <= 1e-9
    assert study.step_error <= 1e-9
