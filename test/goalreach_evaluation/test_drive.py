from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

import numpy as np
import pytest

from goalreach_evaluation.drive import InProcessDrive
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy_file import read_policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Confidence, Pose2
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput

SURVEY_ERROR_M = 0.1016
LATE_FROM, LATE_FOR = 80, 50


@pytest.mark.parametrize(('coordinate', 'start', 'seed'), [(1, 0, 7), (4, 5, 8)])
def test_two_leds_of_a_wrong_survey_declare_no_false_goal(
    coordinate: int, start: int, seed: int
) -> None:
    arena, noise = Arena(), NoiseModel()
    localizer = LocalizerConfig.for_arena(arena, noise)
    told_m = np.array(localizer.landmarks_m)
    told_m[coordinate] += SURVEY_ERROR_M
    drive = InProcessDrive(
        arena=arena,
        noise=noise,
        policy=read_policy('paper'),
        controller=ControllerConfig(mode='fuzzy', timeout_s=20.0),
        localizer=replace(localizer, landmarks_m=tuple(told_m.tolist())),
        seed=np.random.SeedSequence([seed, 5]),
    )
    frames = list(drive.drive_frames(arena.starts[start]))
    assert any(frame.state.confidence is Confidence.OK for frame in frames)
    result = frames[-1].result
    assert result is not None
    assert result.outcome in {'goal', 'timeout'}


@pytest.mark.parametrize('seed', [4, 12, 14])
def test_a_camera_clock_that_was_wrong_for_two_seconds_stops_no_path(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = InProcessDrive(
        arena=Arena(),
        noise=NoiseModel(),
        policy=read_policy('paper'),
        controller=ControllerConfig(),
        seed=np.random.SeedSequence(seed),
    )
    samples: list[dict[str, Any]] = []
    process = LandmarkLocalizer.process

    def late(localizer: LandmarkLocalizer, **given: Any) -> LocalizerOutput:  # noqa: ANN401
        samples.append({name: given[name] for name in ('time_ns', 'joints', 'odometry')})
        images = len(samples) - LATE_FROM
        behind = images // 10 if 0 < images < LATE_FOR else 0
        return process(localizer, **{**given, **samples[-1 - behind]})

    monkeypatch.setattr(LandmarkLocalizer, 'process', late)
    start = Pose2(x_m=1.8, y_m=4.6, heading_rad=-math.pi / 2)
    frames = list(drive.drive_frames(start))
    result = frames[-1].result
    assert result is not None
    assert result.outcome == 'goal'
