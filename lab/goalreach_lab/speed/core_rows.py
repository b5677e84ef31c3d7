"""Rows without ROS: learning, localization, recording, and evaluation over processes."""

import statistics
import subprocess
import sys
import time
from typing import Final

import numpy as np

from goalreach_evaluation.evaluation import EvaluationPlan, drive_sessions
from goalreach_evaluation.starts import random_starts
from goalreach_lab.localization.speed_study import speed_study
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.speed import learning_peers, recording
from goalreach_lab.speed.measurement import Budget, spread
from goalreach_lab.study import find
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel

_TURNS: Final = 60_000_000


def learning_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of a learning phase against IR-SIM and DQN."""
    return learning_peers.execute(learning_peers.Options(rounds=budget.count(3), seed=budget.seed))


def localization_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of the localization time of an image against peers."""
    study = speed_study(frames=budget.count(1000, 20), seed=budget.seed)
    return [
        row for row in study.rows(find(study)) if row.unit == 'ms' and row.reference is not None
    ]


def recording_rows(budget: Budget) -> list[BenchRow]:
    """Return the row of the recorder's writer."""
    return recording.processor_rows(budget.count(300, 5), budget.count(7), ['mcap'])


def evaluation_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of an evaluation by one and two processes, and of half as many drives."""
    drives = budget.count(500, 12)
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
            goal=Goal(of='ratio', relation='>=', bound=0.9),
            n=len(one),
            note=f'{whole_s:.1f} s alone, {spread(one)}; {whole_s / gain:.1f} s on two, '
            f'{spread(two)}, their start included; loops {spread(machine)}',
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
    """Return the throughput of two concurrent plain Python loops over that of one: 2 at best.

    Args:
        turns: Iterations of each loop.
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
