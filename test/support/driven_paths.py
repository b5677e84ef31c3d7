"""A driven path, as an evaluator reports it."""

import math

from goalreach_evaluation.path_metrics import PathResult
from goalreach_msgs_py.values import Pose2


def driven_path(outcome: str = 'goal') -> PathResult:
    """Return a path of 1.5 m that took 2.5 s."""
    return PathResult(
        start=Pose2(x_m=1.0, y_m=2.25, heading_rad=-math.pi / 2),
        outcome=outcome,
        duration_s=2.5,
        length_m=1.5,
        turning_rad=0.0,
        max_heading_step_rad=0.0,
        pose_error_m={},
        heading_error_rad={},
        trace=(),
    )
