"""The simulator: speed of physics and images, flaws in random drives, rate of the clock."""

from dataclasses import dataclass
import math
import statistics
import time

import numpy as np

from goalreach_lab.options import BenchOptions
from goalreach_lab.rigs.random_drives import (
    STEP_S,
    STEPS,
    IrSimDrives,
    RandomDrives,
    drive_batch,
    drive_one,
    is_irsim_installed,
)
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.speed.drive_study import study_drives
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.options import option
from goalreach_sim.camera_renderer import CameraRenderer
from goalreach_sim.camera_view import CameraPose
from goalreach_sim.simulator_config import SimulatorConfig

SUMMARY = 'Physics against IR-SIM, time of an image, flaws in random drives, rate of the clock'

_ROUNDS = 5
_DRIVES_OF_ONE = 8
_NOTHING = 1e-9
_OVERLAP_M = 1e-6
_RATIO = 100.0
_PERCENT = 2.0


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    robots: int = option(8192, 'robots that are simulated at once', minimum=1)
    images: int = option(1000, 'images to time', minimum=1)
    drives: int = option(10_000, 'random drives that search for flaws', minimum=1)
    graph_seconds: float = option(20.0, 'time on the clock of the graph; 0: none', minimum=0.0)
    speed: float = option(4.0, 'speed requested of the graph', above=0.0)


def execute(options: Options) -> list[BenchRow]:
    """Measure.

    Raises:
        GoalreachError: An option is refused, or the graph does not come up.
    """
    rng = np.random.default_rng(options.seed)
    rows = _physics_rows(options.robots, rng)
    rows.append(_image_row(options.images, rng))
    rows += _flaw_rows(options.drives, rng)
    if options.graph_seconds > 0.0:
        rows.append(_clock_row(options.speed, options.graph_seconds, options.seed))
    return rows


def _physics_rows(robots: int, rng: np.random.Generator) -> list[BenchRow]:
    arena = Arena()
    drives = RandomDrives.draw(max(robots, _ROUNDS * _DRIVES_OF_ONE), arena, rng)
    peer = IrSimDrives(arena) if is_irsim_installed() else None
    if peer is None:
        print('IR-SIM is not installed: its column is left out (pip install goalreach[bench])')
    batch, one, other = [], [], []
    for number in range(_ROUNDS):
        chosen = range(number * _DRIVES_OF_ONE, (number + 1) * _DRIVES_OF_ONE)
        batch.append(_robot_seconds(drives.starts.shape[1], _time_batch(drives, arena)))
        one.append(_robot_seconds(_DRIVES_OF_ONE, _time_one(drives, chosen, arena)))
        if peer is not None:
            other.append(_robot_seconds(_DRIVES_OF_ONE, peer.time(drives, chosen)))
    return [
        _physics_row(
            f'{robots} robots at once', batch, other, Goal(of='ratio', relation='>=', bound=_RATIO)
        ),
        _physics_row('one robot', one, other, None),
    ]


def _physics_row(what: str, ours: list[float], other: list[float], goal: Goal | None) -> BenchRow:
    return BenchRow(
        name=f'physics of {what}, {STEP_S:g} s steps, no images',
        unit='robot-s/s',
        ours=statistics.median(ours),
        reference=statistics.median(other) if other else None,
        reference_name='IR-SIM' if other else '',
        goal=goal if other else None,
        n=len(ours),
        note=f'from {min(ours):.3g} to {max(ours):.3g}',
    )


def _robot_seconds(drives: int, wall_s: float) -> float:
    return drives * STEPS * STEP_S / wall_s


def _time_batch(drives: RandomDrives, arena: Arena) -> float:
    began_s = time.perf_counter()
    drive_batch(drives, arena)
    return time.perf_counter() - began_s


def _time_one(drives: RandomDrives, chosen: range, arena: Arena) -> float:
    began_s = time.perf_counter()
    for index in chosen:
        drive_one(drives, index, arena)
    return time.perf_counter() - began_s


def _image_row(images: int, rng: np.random.Generator) -> BenchRow:
    arena = Arena()
    config = SimulatorConfig.for_arena(arena, noise_preset('nominal'))
    leds_m = config.landmark_array_m
    renderer = CameraRenderer(
        config.calibrated_camera,
        leds_m,
        (arena.width_m, arena.length_m),
        optics=config.optics,
        noise=config.noise,
        rng=rng.spawn(1)[0],
        event_rng=rng.spawn(1)[0],
    )
    middle_m, took_ms = leds_m.mean(axis=0), []
    for x_m, y_m in rng.uniform((0.3, 1.5), (3.2, 4.7), (images, 2)).tolist():
        centre_m = np.array([x_m, y_m, config.camera_height_m])
        dx_m, dy_m, dz_m = (middle_m - centre_m).tolist()
        pose = CameraPose(
            centre_m=centre_m,
            azimuth_rad=math.atan2(dy_m, dx_m),
            tilt_rad=math.atan2(dz_m, math.hypot(dx_m, dy_m)),
            velocity_m_per_s=np.zeros(3),
            azimuth_rad_per_s=0.0,
            tilt_rad_per_s=0.0,
        )
        began_s = time.perf_counter()
        renderer.render(pose)
        took_ms.append((time.perf_counter() - began_s) * 1e3)
    return BenchRow(
        name='rendering a nominal 640x480 image of three LEDs, median',
        unit='ms',
        ours=statistics.median(took_ms),
        n=images,
        note=f'99 of 100 within {np.percentile(took_ms, 99):.3g} ms',
    )


def _flaw_rows(drives: int, rng: np.random.Generator) -> list[BenchRow]:
    study = study_drives(drives, rng)
    figures = (
        ('overlap of body and wall', 'm', study.overlap_m, _OVERLAP_M),
        ('speed above the limit', 'm/s, rad/s', study.speed_excess, _NOTHING),
        (
            'gain of speed beyond the acceleration',
            'm/s, rad/s',
            study.acceleration_excess,
            _NOTHING,
        ),
        ('odometry from truth, errors off, per metre', 'm/m', study.odometry_error_m, _NOTHING),
        ('pose in long steps from short ones', 'm, rad', study.step_error, _NOTHING),
    )
    return [
        BenchRow(
            name=f'random drives: worst {what}',
            unit=unit,
            ours=worst,
            goal=Goal(of='ours', relation='<=', bound=bound),
            n=study.drives,
            note=f'{study.bumps} of them ended against a wall' if number == 0 else '',
        )
        for number, (what, unit, worst, bound) in enumerate(figures)
    ]


def _clock_row(speed: float, seconds: float, seed: int) -> BenchRow:
    from goalreach_lab.rigs.ros_run_clock import measure_clock_rate

    seen = measure_clock_rate(speed, seconds, seed)
    off = min(abs(seen.measured / expected - 1.0) for expected in (speed, seen.reported))
    return BenchRow(
        name=f'clock of the graph at --speed {speed:g}, off the requested or the reported speed',
        unit='%',
        ours=off * 100.0,
        goal=Goal(of='ours', relation='<=', bound=_PERCENT),
        n=seen.ticks,
        note=f'measured {seen.measured:.4g} times real time, reported {seen.reported:.4g}',
    )
