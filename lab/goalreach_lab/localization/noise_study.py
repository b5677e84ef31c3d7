"""Errors and availability over the size of all errors of sensors and set-up."""

from __future__ import annotations

import functools
from typing import Any, Final

import numpy as np

from goalreach_evaluation.sessions import each
from goalreach_lab.localization.frame_log import FrameLog, Frames, percentiles
from goalreach_lab.localization.wanderer import Wanderer
from goalreach_lab.row import BenchRow
from goalreach_msgs_py.noise import NoiseModel

SCALES: Final = {'none': 0.0, 'half': 0.5, 'nominal': 1.0, 'one and a half': 1.5, 'harsh': 2.0}
_RUN_FRAMES: Final = 1500


def study_noise(*, robots: int, seed: int, jobs: int) -> dict[str, Any]:
    """Return how robots do that wander for a minute, at each scale of the noise.

    Args:
        robots: How many, each with its own drawn errors, the same draws at every scale.
        seed: Of everything random.
        jobs: Processes.
    """
    result: dict[str, Any] = {'robots': robots, 'scales': {}}
    for name, scale in SCALES.items():
        run = functools.partial(_run, scale=scale, seed=seed)
        frames = Frames.joined(list(each(run, range(robots), jobs=jobs)))
        good = frames.trusted
        leds = np.bincount(frames.leds.astype(int), minlength=4) / len(frames)
        result['scales'][name] = {
            'scale': scale,
            'frames': len(frames),
            'position_in': percentiles(frames.error_in[good]),
            'heading_deg': percentiles(frames.turned_deg[good]),
            'available': float(good.mean()),
            'leds': leds.tolist(),
            'wrong': int(frames.wrong.sum()),
        }
    return result


def _run(number: int, *, scale: float, seed: int) -> Frames:
    robot = Wanderer((seed, number, 50), noise=NoiseModel().scaled(scale))
    log = FrameLog()
    for step in robot.run(_RUN_FRAMES):
        log.look(step.frame, step.output)
    return log.take()


def noise_rows(result: dict[str, Any]) -> list[BenchRow]:
    """Return the rows of the study."""
    rows = []
    for name, found in result['scales'].items():
        position, heading = found['position_in'], found['heading_deg']
        three, two, one, none = (100.0 * found['leds'][count] for count in (3, 2, 1, 0))
        rows += [
            BenchRow(
                name=f'noise {name} ({found["scale"]:g} x nominal): position error p95',
                unit='in',
                ours=position['p95'],
                n=found['frames'],
                note=f'{result["robots"]} robots; rms {position["rms"]:.2f}, max '
                f'{position["max"]:.2f} in; heading p95 {heading["p95"]:.2f} deg; '
                f'{found["wrong"]} images with a wrong pose believed',
            ),
            BenchRow(
                name=f'noise {name}: a good pose is there',
                unit='% of the time',
                ours=100.0 * found['available'],
                n=found['frames'],
                note=f'the first search included; 3 LEDs {three:.1f} %, 2 {two:.1f} %, '
                f'1 {one:.1f} %, 0 {none:.1f} % of images',
            ),
        ]
    return rows
