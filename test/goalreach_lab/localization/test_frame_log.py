from __future__ import annotations

import math

import numpy as np
import pytest

from goalreach_lab.localization.frame_log import (
    FrameLog,
    Frames,
    longest_gap_s,
    overconfident_episodes,
    pose_error,
    pose_nees,
)
from goalreach_lab.localization.waypoint_robot import WaypointRobot
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import Pose2, PoseEstimate


def test_errors_wrap_the_heading() -> None:
    first = Pose2(x_m=1.0, y_m=2.0, heading_rad=3.1)
    second = Pose2(x_m=0.5, y_m=2.5, heading_rad=-3.1)
    assert pose_error(first, second) == pytest.approx([0.5, -0.5, 6.2 - math.tau])


def test_nees_by_hand() -> None:
    truth = Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)
    pose = Pose2(x_m=0.2, y_m=-0.1, heading_rad=0.3)
    estimate = PoseEstimate(pose=pose, covariance=np.diag([0.01, 0.01, 0.09]))
    assert pose_nees(estimate, truth) == pytest.approx(4.0 + 1.0 + 1.0)


def frames(*seen: tuple[bool, float]) -> Frames:
    """Return a drive at 25 Hz with the trust and error (in) given for each frame."""
    trusted, errors_in = zip(*seen, strict=True)
    zeros = dict.fromkeys(Frames._fields, [0.0] * len(seen))
    times = {'time_s': [0.04 * k for k in range(len(seen))], 'nees': [1.0] * len(seen)}
    return Frames.from_json({**zeros, **times, 'trusted': trusted, 'error_in': errors_in})


GOOD, WRONG, NONE = (True, 0.5), (True, 9.0), (False, 0.0)


def test_overconfident_episodes_by_hand() -> None:
    (episode,) = overconfident_episodes(frames(GOOD, WRONG, WRONG, NONE, NONE, NONE, GOOD, GOOD))
    assert episode.began_s == pytest.approx(0.04)
    assert episode.detected_s == pytest.approx(0.08)
    assert episode.recovered_s == pytest.approx(0.20)
    assert episode.worst_in == 9.0
    assert overconfident_episodes(frames(GOOD, NONE, GOOD)) == []


def test_an_episode_that_no_right_pose_follows_is_not_recovered() -> None:
    (episode,) = overconfident_episodes(frames(GOOD, WRONG, NONE))
    assert episode.recovered_s == float('inf')


def test_the_longest_gap_by_hand() -> None:
    assert longest_gap_s(frames(NONE, NONE, GOOD, NONE, GOOD, NONE, NONE, NONE, GOOD)) == (
        pytest.approx(0.12)
    )
    assert longest_gap_s(frames(GOOD, GOOD)) == pytest.approx(0.0)
    assert longest_gap_s(frames(NONE)) == float('inf')


def test_frames_survive_their_results() -> None:
    log = FrameLog()
    for step in WaypointRobot((1, 2), noise=noise_preset('nominal')).run(120):
        log.add_output(step.frame, step.output)
    drive = log.take()
    again = Frames.from_json(drive.to_json())
    assert 0 < drive.trusted.sum() < 120
    for values, kept in zip(drive, again, strict=True):
        assert kept.tolist() == pytest.approx(values.tolist(), abs=1e-5, nan_ok=True)
        assert kept.dtype == values.dtype
    assert len(Frames.join([drive, again]).leds) == 240
