"""Driving with rendered images in one process: speed against IR-SIM, growth, profile."""

from collections.abc import Sequence
import cProfile
from dataclasses import replace
from pathlib import PurePath
import pstats
import statistics
import time
from typing import Any, Final, NamedTuple

import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_lab.rigs.random_drives import STEPS, IrSimDrives, RandomDrives, is_irsim_installed
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.speed.measurement import Budget, spread
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import DEFAULT_LANDMARKS_M, Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_sim.simulator_config import SimulatorConfig

_LIDAR_RAYS: Final = 180
_IRSIM_DRIVES: Final = 16
_SIZES_PX: Final = ((320, 240), (640, 480), (960, 720), (1280, 960))
_LED_COUNTS: Final = (3, 4, 5, 6)
_MORE_LEDS_M: Final = ((2.2, 0.0, 1.45), (1.4, 0.0, 1.6), (3.0, 0.0, 1.5))
_PATHS: Final = 4
_OTHERS: Final = 'everything else'
_OURS: Final = 'goalreach_'


def peer_row(rounds: int, seed: int) -> BenchRow:
    """Return the row of ours and of IR-SIM with a lidar, measured in turns.

    Args:
        rounds: Times all starts are driven.
        seed: Seed of everything random.
    """
    peer = IrSimDrives(Arena(), lidar_rays=_LIDAR_RAYS) if is_irsim_installed() else None
    if peer is None:
        print('IR-SIM is not installed: left out (pip install goalreach[bench])')
    ours: list[tuple[int, float]] = []
    steps: list[float] = []
    for _ in range(rounds):
        ours.append(_drive_all_starts(seed))
        if peer is not None:
            steps.append(_irsim_steps_per_s(peer, seed))
    by_cpu = [frames / cpu_s for frames, cpu_s in ours]
    return BenchRow(
        name='driving in one process, frames per second of processor time, best',
        unit='frames/s',
        ours=max(by_cpu),
        reference=max(steps) if steps else None,
        reference_name=f'steps of IR-SIM with a lidar of {_LIDAR_RAYS} rays' if steps else '',
        goal=Goal(of='ratio', relation='>=', bound=1.2) if steps else None,
        n=rounds,
        note=f'{spread(by_cpu, steps)}; {ours[0][0]} frames a round',
    )


def _in_process_drive(arena: Arena, noise: NoiseModel, seed: int, **more: Any) -> InProcessDrive:
    return InProcessDrive(
        arena=arena,
        noise=noise,
        policy=train(arena, rng=np.random.default_rng(seed)).policy,
        controller=ControllerConfig(),
        seed=np.random.SeedSequence(seed),
        **more,
    )


def _drive_all_starts(seed: int) -> tuple[int, float]:
    """Drive from every start of the paper's arena; return frames and processor time, s."""
    drive = _in_process_drive(Arena(), NoiseModel(), seed)
    began_s = time.process_time()
    for path, start in enumerate(Arena().starts):
        drive.drive(start, path=path)
    return drive.frames, time.process_time() - began_s


def _irsim_steps_per_s(peer: IrSimDrives, seed: int) -> float:
    """Return how many steps IR-SIM makes in a second of processor time."""
    drives = RandomDrives.draw(_IRSIM_DRIVES, Arena(), np.random.default_rng(seed))
    cpu_s = peer.time(drives, range(_IRSIM_DRIVES), time.process_time)
    return _IRSIM_DRIVES * STEPS / cpu_s


def driving_rows(budget: Budget) -> list[BenchRow]:
    """Return the row against IR-SIM, and the growth of a frame's time with image and LEDs."""
    sizes = [width * height * 1e-6 for width, height in _SIZES_PX]
    by_size: list[list[float]] = [[] for _ in sizes]
    by_leds: list[list[float]] = [[] for _ in _LED_COUNTS]
    for number in range(budget.count(3)):
        for place, size_px in enumerate(_SIZES_PX):
            by_size[place].append(frame_ms(budget.seed + number, size_px=size_px))
        for place, leds in enumerate(_LED_COUNTS):
            by_leds[place].append(frame_ms(budget.seed + number, leds=leds))
    return [
        peer_row(budget.count(5), budget.seed),
        _growth_row('with the image', 'ms/Mpixel', sizes, by_size),
        _growth_row('with the number of LEDs', 'ms/LED', _LED_COUNTS, by_leds),
    ]


def _growth_row(
    what: str, unit: str, x: Sequence[float], times_ms: Sequence[Sequence[float]]
) -> BenchRow:
    medians_ms = [statistics.median(one) for one in times_ms]
    slope, intercept_ms = statistics.linear_regression(x, medians_ms)
    r_squared = statistics.correlation(x, medians_ms) ** 2
    points = ', '.join(f'{at:.3g}: {ms:.3f}' for at, ms in zip(x, medians_ms, strict=True))
    return BenchRow(
        name=f'driving in one process, growth of a frame {what}',
        unit=unit,
        ours=slope,
        n=len(times_ms[0]),
        note=f'{intercept_ms:.3f} ms + {slope:.3g} {unit} (R2 {r_squared:.2f}); {points}',
    )


def frame_ms(
    seed: int, *, size_px: tuple[int, int] = (640, 480), leds: int = len(DEFAULT_LANDMARKS_M)
) -> float:
    """Return the processor time of one frame of driving, with another camera or other LEDs.

    Args:
        seed: Seed of everything random.
        size_px: Width and height of the image.
        leds: Number of LEDs.
    """
    arena = Arena(landmarks_m=(*DEFAULT_LANDMARKS_M, *_MORE_LEDS_M)[:leds])
    noise = NoiseModel()
    simulator = replace(
        SimulatorConfig.for_arena(arena, noise),
        image_width_px=size_px[0],
        image_height_px=size_px[1],
    )
    drive = _in_process_drive(arena, noise, seed, simulator=simulator)
    began_s = time.process_time()
    for path, start in enumerate(arena.starts[:_PATHS]):
        drive.drive(start, path=path)
    return (time.process_time() - began_s) * 1e3 / drive.frames


class Share(NamedTuple):
    """The part of the time that a `package.module` takes, with what it calls outside of them."""

    module: str
    percent: float


def profile_driving(seed: int, *, paths: int, most: int = 12) -> list[Share]:
    """Drive paths in one process under a profiler; return the modules that take most.

    Args:
        seed: Seed of everything random.
        paths: Number of the paper's starts to drive from.
        most: Number of modules to name; the rest is one line.
    """
    drive = _in_process_drive(Arena(), NoiseModel(), seed)
    profiler = cProfile.Profile(time.process_time)
    with profiler:
        for path, start in enumerate(Arena().starts[:paths]):
            drive.drive(start, path=path)
    stats: Any = pstats.Stats(profiler)
    by_module: dict[str, float] = {}
    for (file, _, _), (_, _, own_s, _, callers) in stats.stats.items():
        if _module(file) != _OTHERS or not callers:
            by_module[_module(file)] = by_module.get(_module(file), 0.0) + own_s
            continue
        for (caller, _, _), (_, _, for_caller_s, _) in callers.items():
            by_module[_module(caller)] = by_module.get(_module(caller), 0.0) + for_caller_s
    return _largest(by_module, most)


def _module(file: str) -> str:
    path = PurePath(file)
    packages = [part for part in path.parts[:-1] if part.startswith(_OURS)]
    return f'{packages[-1]}.{path.stem}' if packages else _OTHERS


def _largest(by_module: dict[str, float], most: int) -> list[Share]:
    total_s = sum(by_module.values())
    ordered = sorted(by_module.items(), key=lambda item: -item[1])
    named = [item for item in ordered if item[0] != _OTHERS][:most]
    shares = [Share(name, 100.0 * own_s / total_s) for name, own_s in named]
    return [*shares, Share(_OTHERS, 100.0 - sum(share.percent for share in shares))]
