"""The parts of the study by name: what each measures, with which sizes, and its rows."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

from goalreach_lab.localization.bound_study import bound_rows, study_bound
from goalreach_lab.localization.consistency_study import consistency_rows, study_consistency
from goalreach_lab.localization.drive_study import drive_rows, study_drives
from goalreach_lab.localization.input_study import input_rows, study_inputs
from goalreach_lab.localization.kidnap_study import kidnap_rows, study_kidnaps
from goalreach_lab.localization.long_study import kept_long, long_rows, study_long
from goalreach_lab.localization.noise_study import noise_rows, study_noise
from goalreach_lab.localization.speed_study import speed_rows, study_speed
from goalreach_lab.reproduction.results_file import ResultsFolder
from goalreach_lab.row import BenchRow

_Result = dict[str, Any]


class _Part(NamedTuple):
    """One part: its sizes among the options, what measures it, what makes rows of it."""

    sizes: tuple[str, ...]
    study: Callable[[argparse.Namespace], _Result]
    rows: Callable[[_Result], list[BenchRow]]


def _bound(asked: argparse.Namespace) -> _Result:
    return study_bound(
        trials=asked.bound_images,
        identified=asked.labelled_images,
        seed=asked.seed,
        jobs=asked.jobs,
    )


def _drives(asked: argparse.Namespace) -> _Result:
    return study_drives(
        starts=asked.starts, robots=asked.calibrated_robots, seed=asked.seed, jobs=asked.jobs
    )


def _consistency(asked: argparse.Namespace) -> _Result:
    return {
        name: study_consistency(
            runs=asked.runs,
            run_s=asked.run_seconds,
            seed=asked.seed,
            jobs=asked.jobs,
            calibrate=calibrate,
        )
        for name, calibrate in (('not calibrating', False), ('calibrating', True))
    }


def _kidnap(asked: argparse.Namespace) -> _Result:
    return study_kidnaps(count=asked.kidnaps, seed=asked.seed, jobs=asked.jobs)


def _noise(asked: argparse.Namespace) -> _Result:
    return study_noise(robots=asked.noise_robots, seed=asked.seed, jobs=asked.jobs)


def _long(asked: argparse.Namespace) -> _Result:
    return study_long(hours=asked.hours, seed=asked.seed, folder=asked.results)


def _inputs(asked: argparse.Namespace) -> _Result:
    return study_inputs(seed=asked.seed)


def _speed(asked: argparse.Namespace) -> _Result:
    return study_speed(frames=asked.frames, seed=asked.seed)


_PARTS = {
    'bound': _Part(('bound_images', 'labelled_images'), _bound, bound_rows),
    'noise': _Part(('noise_robots',), _noise, noise_rows),
    'drives': _Part(('starts', 'calibrated_robots'), _drives, drive_rows),
    'consistency': _Part(('runs', 'run_seconds'), _consistency, consistency_rows),
    'kidnap': _Part(('kidnaps',), _kidnap, kidnap_rows),
    'long': _Part(('hours',), _long, long_rows),
    'inputs': _Part((), _inputs, input_rows),
    'speed': _Part(('frames',), _speed, speed_rows),
}


PARTS: Final = tuple(_PARTS)


def kept(part: str, folder: Path, asked: argparse.Namespace) -> _Result | None:
    """Return what a part found earlier, or None; of a long drive what there is of it so far.

    Args:
        part: Its name.
        folder: Where it was kept.
        asked: Sizes and seed.
    """
    found = ResultsFolder(folder).read(name_of(part, asked))
    if found is None and part == 'long' and asked.as_it_is:
        return kept_long(folder, asked.seed)
    return None if found is None else dict(found)


def measure(part: str, asked: argparse.Namespace) -> _Result:
    """Return what a part finds, ready for JSON.

    Args:
        part: Its name.
        asked: Sizes, seed and jobs.
    """
    return _PARTS[part].study(asked)


def name_of(part: str, asked: argparse.Namespace) -> str:
    """Return the name under which a result is kept: part, sizes and seed."""
    sizes = ''.join(f'-{getattr(asked, size):g}' for size in _PARTS[part].sizes)
    return f'{part}{sizes}-seed-{asked.seed}'


def rows_of(part: str, result: _Result) -> list[BenchRow]:
    """Return the rows of a result."""
    return _PARTS[part].rows(result)
