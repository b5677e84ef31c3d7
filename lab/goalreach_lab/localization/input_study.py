"""What the localizer makes of images and readings that tell nothing, or cannot be."""

from __future__ import annotations

from collections.abc import Callable
import copy
import dataclasses
from dataclasses import replace
import math
import re
from typing import Any, Final

import numpy as np

from goalreach_lab.localization.wanderer import Wanderer
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import Twist2
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_sim.sensors import SensorFrame

_Spoil = Callable[[SensorFrame, np.random.Generator], dict[str, Any]]
_INPUTS: Final = ('time_ns', 'image', 'camera', 'joints', 'odometry')
_TRACKED_FRAMES: Final = 150
_BAD_FRAMES: Final = 40
_ON: Final = Twist2(linear_m_per_s=0.3, steering_rad_per_s=0.0)


def _noise(frame: SensorFrame, rng: np.random.Generator) -> dict[str, Any]:
    dn = 16.0 + 8.0 * rng.standard_normal(frame.image.shape)
    return {'image': np.clip(dn, 0.0, 255.0).astype(np.uint8)}


def _uniform(frame: SensorFrame, rng: np.random.Generator) -> dict[str, Any]:
    return {'image': rng.integers(0, 256, frame.image.shape).astype(np.uint8)}


def _joints(frame: SensorFrame, **change: float) -> dict[str, Any]:
    return {'joints': replace(frame.joints, **change)}


def _odometry(frame: SensorFrame, **change: float) -> dict[str, Any]:
    pose = replace(frame.odometry.pose, **change)
    return {'odometry': replace(frame.odometry, pose=pose)}


_STALE = 'odometry that stands still'
BAD_INPUTS: Final[dict[str, _Spoil]] = {
    'noise only, 8 grey values': _noise,
    'noise only, all grey values': _uniform,
    'saturated white': lambda frame, _: {'image': np.full_like(frame.image, 255)},
    'all black': lambda frame, _: {'image': np.zeros_like(frame.image)},
    'half the size': lambda frame, _: {'image': frame.image[::2, ::2]},
    'on its side': lambda frame, _: {'image': np.ascontiguousarray(frame.image.T)},
    'in colour': lambda frame, _: {'image': np.repeat(frame.image[..., None], 3, axis=2)},
    'sixteen bits': lambda frame, _: {'image': frame.image.astype(np.uint16)},
    'floating point': lambda frame, _: {'image': frame.image / 255.0},
    'no image': lambda _frame, _: {'image': None},
    'turret NaN': lambda frame, _: _joints(frame, turret_rad=math.nan),
    'pan NaN': lambda frame, _: _joints(frame, pan_rad=math.nan),
    'tilt infinite': lambda frame, _: _joints(frame, tilt_rad=math.inf),
    'odometry NaN': lambda frame, _: _odometry(frame, x_m=math.nan),
    'heading of odometry infinite': lambda frame, _: _odometry(frame, heading_rad=math.inf),
    _STALE: lambda _frame, _: {},
    'a stamp of long ago': lambda frame, _: {'time_ns': frame.time_ns - 10_000_000_000},
}


def study_inputs(*, seed: int) -> dict[str, Any]:
    """Return what came of every bad input, each given to a localizer that tracks.

    Each case lasts 40 images (1.6 s) in the place of good ones, then good ones come again.

    Args:
        seed: Of everything random.
    """
    robot = Wanderer((seed, 60), noise=noise_preset('nominal'))
    for _ in range(_TRACKED_FRAMES):
        robot.step()
    cases = {name: _case(copy.deepcopy(robot), name, seed) for name in BAD_INPUTS}
    try:
        from goalreach_lab.localization.ros_bad_messages import refused_messages
    except ImportError:
        print('no ROS message packages: the cases of the messages are left out')
        return {'cases': cases, 'messages': {}}
    return {'cases': cases, 'messages': refused_messages(robot.step().frame)}


def _case(robot: Wanderer, name: str, seed: int) -> dict[str, Any]:
    spoil, rng = BAD_INPUTS[name], np.random.default_rng([seed, 61])
    outputs: list[LocalizerOutput] = []
    before = robot.step().frame.odometry
    for _ in range(_BAD_FRAMES):
        robot.simulator.command_drive(_ON)
        robot.simulator.advance()
        frame = robot.simulator.sense()
        fields = {field.name: getattr(frame, field.name) for field in dataclasses.fields(frame)}
        inputs = {name: fields[name] for name in _INPUTS}
        stale = {'odometry': before} if name == _STALE else {}
        outputs.append(robot.localizer.process(**{**inputs, **spoil(frame, rng), **stale}))
    last = outputs[-1]
    back = (k for k, step in enumerate(robot.run(250)) if step.output.mode == 'tracking')
    return {
        'good': sum(output.mode == 'tracking' for output in outputs),
        'reasons': len({_words(output) for output in outputs if output.mode == last.mode}),
        'said': f'{last.mode}: {last.reason}',
        'back_s': next(back, math.inf) / 25.0,
    }


def _words(output: LocalizerOutput) -> str:
    """Return a reason without its numbers."""
    return re.sub(r'[-+]?\d[\d.]*', '#', output.reason)


def input_rows(result: dict[str, Any]) -> list[BenchRow]:
    """Return the rows of bad inputs."""
    cases, messages = result['cases'], result['messages']
    good = {name: case['good'] for name, case in cases.items() if case['good']}
    vague = [name for name, case in cases.items() if case['reasons'] != 1 or not case['said']]
    vague += [name for name, said in messages.items() if not said]
    late = max(case['back_s'] for case in cases.values())
    none = Goal(of='ours', relation='<=', bound=0.0)
    return [
        BenchRow(
            name='bad inputs from which a pose was published as good',
            unit='cases',
            ours=len(good),
            goal=none,
            n=len(cases) + len(messages),
            note=', '.join(f'{name}: {count} images' for name, count in good.items()),
        ),
        BenchRow(
            name='bad inputs without exactly one clear reason',
            unit='cases',
            ours=len(vague),
            goal=none,
            n=len(cases) + len(messages),
            note=', '.join(vague),
        ),
        BenchRow(
            name='a good pose again after good inputs came back, longest',
            unit='s',
            ours=late,
            n=len(cases),
        ),
    ]
