"""Where the time of a frame goes, by module of ours."""

from __future__ import annotations

import cProfile
from pathlib import PurePath
import pstats
import time
from typing import Any, Final, NamedTuple

import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel

_OTHERS: Final = 'everything else'
_OURS: Final = 'goalreach_'


class Share(NamedTuple):
    """A module's part of the time.

    Attributes:
        module: `package.module`.
        percent: Time spent in it, and in what it calls of others' code.
    """

    module: str
    percent: float


def profile_driving(seed: int, *, paths: int, most: int = 12) -> list[Share]:
    """Drive paths in one process under a profiler; return the modules that take most.

    Args:
        seed: Seed of everything random.
        paths: How many of the paper's starts to drive from.
        most: How many modules to name; the rest is one line.
    """
    arena = Arena()
    drive = InProcessDrive(
        arena=arena,
        noise=NoiseModel(),
        policy=train(arena, rng=np.random.default_rng(seed)).policy,
        controller=ControllerConfig(),
        seed=np.random.SeedSequence(seed),
    )
    profiler = cProfile.Profile(time.process_time)
    with profiler:
        for path, start in enumerate(arena.starts[:paths]):
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
