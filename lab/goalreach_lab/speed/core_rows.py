"""What runs in one process, or in several, without ROS."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
import multiprocessing
from pathlib import Path
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Final

import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_evaluation.sessions import EvaluationPlan, drive_sessions
from goalreach_evaluation.starts import random_starts
from goalreach_lab.localization.speed_study import speed_rows, study_speed
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.speed import frames, learning_peers, recording
from goalreach_lab.speed.budget import Budget
from goalreach_lab.speed.samples import fit_line, spread
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import DEFAULT_LANDMARKS_M, Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_sim.simulator_config import SimulatorConfig

_SIZES_PX: Final = ((320, 240), (640, 480), (960, 720), (1280, 960))
_LED_COUNTS: Final = (3, 4, 5, 6)
_MORE_LEDS_M: Final = ((2.2, 0.0, 1.45), (1.4, 0.0, 1.6), (3.0, 0.0, 1.5))
_PATHS: Final = 4
_TURNS: Final = 60_000_000


def learning_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of a learning phase beside IR-SIM and DQN."""
    return learning_peers.execute(Namespace(rounds=budget.count(3), seed=budget.seed))


def localization_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of the time of an image beside other ways."""
    found = study_speed(frames=budget.count(1000, 20), seed=budget.seed)
    return [row for row in speed_rows(found) if row.unit == 'ms' and row.reference is not None]


def recording_rows(budget: Budget) -> list[BenchRow]:
    """Return the row of the recorder's writer, in a process of its own, as recorders are.

    What a process has done before decides whether its allocator keeps blocks of this size or has
    the kernel make them anew: the same writer takes 150 or 450 us for an image.
    """
    context = multiprocessing.get_context('spawn')
    with (
        tempfile.TemporaryDirectory(prefix='goalreach-') as folder,
        ProcessPoolExecutor(max_workers=1, mp_context=context) as alone,
    ):
        images, rounds = budget.count(300, 5), budget.count(7)
        return [alone.submit(recording.processor_row, Path(folder), images, rounds).result()]


def driving_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of driving with images in one process, and how its time grows."""
    first, *_ = frames.execute(
        Namespace(rounds=budget.count(5), noise='nominal', seed=budget.seed)
    )
    rounds = budget.count(3)
    sizes = [width * height * 1e-6 for width, height in _SIZES_PX]
    by_size: list[list[float]] = [[] for _ in sizes]
    by_leds: list[list[float]] = [[] for _ in _LED_COUNTS]
    for number in range(rounds):
        for place, size_px in enumerate(_SIZES_PX):
            by_size[place].append(frame_ms(budget.seed + number, size_px=size_px))
        for place, leds in enumerate(_LED_COUNTS):
            by_leds[place].append(frame_ms(budget.seed + number, leds=leds))
    return [
        first,
        _growth_row('with the image', 'ms/Mpixel', sizes, by_size),
        _growth_row('with the number of LEDs', 'ms/LED', _LED_COUNTS, by_leds),
    ]


def _growth_row(
    what: str, unit: str, x: Sequence[float], times_ms: Sequence[Sequence[float]]
) -> BenchRow:
    medians_ms = [statistics.median(one) for one in times_ms]
    line = fit_line(x, medians_ms)
    points = ', '.join(f'{at:.3g}: {ms:.3f}' for at, ms in zip(x, medians_ms, strict=True))
    return BenchRow(
        name=f'driving in one process, growth of a frame {what}',
        unit=unit,
        ours=line.slope,
        n=len(times_ms[0]),
        note=f'{line.start:.3f} ms + {line.slope:.3g} {unit} (R2 {line.r_squared:.2f}); {points}',
    )


def frame_ms(
    seed: int, *, size_px: tuple[int, int] = (640, 480), leds: int = len(DEFAULT_LANDMARKS_M)
) -> float:
    """Return the processor time of a frame of driving, with another camera or other LEDs."""
    arena = Arena(landmarks_m=(*DEFAULT_LANDMARKS_M, *_MORE_LEDS_M)[:leds])
    noise = NoiseModel()
    width_px, height_px = size_px
    drive = InProcessDrive(
        arena=arena,
        noise=noise,
        policy=train(arena, rng=np.random.default_rng(seed)).policy,
        controller=ControllerConfig(),
        seed=np.random.SeedSequence(seed),
        simulator=replace(
            SimulatorConfig.for_arena(arena, noise),
            image_width_px=width_px,
            image_height_px=height_px,
        ),
    )
    began_s = time.process_time()
    for path, start in enumerate(arena.starts[:_PATHS]):
        drive.drive(start, path=path)
    return (time.process_time() - began_s) * 1e3 / drive.frames


def evaluation_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of many drives: on two processes against one, and over their number."""
    drives = budget.count(500, 44)
    one, two, half, machine = [], [], [], []
    for number in range(budget.count(3)):
        machine.append(machine_gain(budget.count(_TURNS)))
        seed = budget.seed + number
        one.append(_evaluate_s(drives, seed, jobs=1))
        two.append(_evaluate_s(drives, seed, jobs=2))
        half.append(_evaluate_s(drives // 2, seed, jobs=1))
    whole_s, half_s = statistics.median(one), statistics.median(half)
    gain = whole_s / statistics.median(two)
    return [
        BenchRow(
            name=f'evaluation of {drives} drives, two processes, times as fast as one',
            unit='times',
            ours=gain,
            reference=statistics.median(machine),
            reference_name='two plain loops at once',
            goal=Goal(of='ours', relation='>=', bound=1.8),
            n=len(one),
            note=f'{whole_s:.1f} s alone, {spread(one)}; {whole_s / gain:.1f} s on two, '
            f'{spread(two)}, starting the processes counts; loops {spread(machine)}',
        ),
        BenchRow(
            name='evaluation, time of twice the drives by twice the time',
            unit='',
            ours=whole_s / half_s / 2.0,
            n=len(one),
            note='1 is linear in the number of drives',
        ),
    ]


def machine_gain(turns: int) -> float:
    """Return how much more two plain loops of Python at once get done than one: 2 at best.

    Args:
        turns: How often each goes round.
    """

    def taken_s(count: int) -> float:
        loop = f'total = 0\nfor i in range({turns}): total += i * i'
        began_s = time.perf_counter()
        loops = [subprocess.Popen([sys.executable, '-c', loop]) for _ in range(count)]
        for one in loops:
            one.wait()
        return time.perf_counter() - began_s

    return 2.0 * taken_s(1) / taken_s(2)


def _evaluate_s(drives: int, seed: int, *, jobs: int) -> float:
    arena = Arena()
    rng = np.random.default_rng(seed)
    plan = EvaluationPlan(
        arena=arena,
        noise=NoiseModel(),
        policy=train(arena, rng=rng).policy,
        controller=ControllerConfig(),
        starts=random_starts(arena, drives, rng),
        seed=seed,
    )
    began_s = time.perf_counter()
    drive_sessions(plan, jobs=jobs)
    return time.perf_counter() - began_s
