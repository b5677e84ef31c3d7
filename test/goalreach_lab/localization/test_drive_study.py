import math

import numpy as np

from goalreach_lab.localization.drive_study import first_pose_s
from goalreach_lab.localization.frame_log import Frames


def frames(trusted: list[bool]) -> Frames:
    count = len(trusted)
    zeros = np.zeros(count)
    return Frames(
        time_s=np.array([5.0 + 0.04 * number for number in range(count)], dtype=np.float64),
        error_in=zeros,
        turned_deg=zeros,
        nees=zeros,
        trusted=np.array(trusted),
        leds=np.zeros(count, dtype=np.int64),
        nis=zeros,
        nis_dof=zeros,
    )


def test_the_first_pose_is_that_of_the_first_trusted_image() -> None:
    assert math.isclose(first_pose_s(frames([False, False, True, False])), 0.08)
    assert first_pose_s(frames([False, False])) == math.inf
