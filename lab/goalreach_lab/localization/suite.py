"""The localization suite: accuracy, consistency, robustness, speed; docs/LOCALIZATION.md."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
import time
from typing import TYPE_CHECKING, Any

from goalreach_lab.row import BenchRow

if TYPE_CHECKING:
    from goalreach_lab.study import Study

SUMMARY = 'Accuracy, consistency, robustness and speed of the localizer'

PARTS = ('bound', 'noise', 'drives', 'consistency', 'kidnap', 'long', 'inputs', 'speed')

_SIZES: dict[str, tuple[float, float, str]] = {
    'bound-images': (300, 4000, 'noisy images at each place, for each noise'),
    'labelled-images': (2, 20, 'how many of them are labelled too'),
    'noise-robots': (2, 4, 'robots that drive for a minute at each scale of the noise'),
    'starts': (22, 200, "random starts in addition to the paper's 22"),
    'calibrated-robots': (1, 4, 'robots that calibrate themselves for ten minutes'),
    'runs': (12, 100, 'runs of the consistency study'),
    'run-seconds': (20, 60, 'length of each of them'),
    'kidnaps': (60, 2000, 'kidnappings'),
    'hours': (0.05, 24, 'length of the long drive'),
    'frames': (400, 1000, 'images that are timed'),
}
"""Default, `--full`, and description."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    parser.add_argument(
        '--part', nargs='+', choices=PARTS, default=list(PARTS), help='what to measure'
    )
    parser.add_argument(
        '--full', action='store_true', help='the sizes of docs/LOCALIZATION.md, not small ones'
    )
    for name, (small, full, text) in _SIZES.items():
        parser.add_argument(
            f'--{name}',
            type=type(full) if name != 'hours' else float,
            default=None,
            metavar='N',
            help=f'{text}; {small:g}, with --full {full:g}',
        )
    parser.add_argument('--jobs', type=int, default=1, help='processes; the result is the same')
    parser.add_argument(
        '--results',
        type=Path,
        default=None,
        metavar='DIR',
        help='where finished cases are kept; they are not measured again',
    )
    parser.add_argument(
        '--as-it-is', action='store_true', help='use what is in --results, measure nothing'
    )
    parser.add_argument('--figures', type=Path, metavar='DIR', help='where the figures go')
    parser.add_argument('--out', type=Path, metavar='FILE', help='the document, in Markdown')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure the cases that are not finished; draw and write what is asked for.

    Raises:
        GoalreachError: An option is refused or a file cannot be read or written.
    """
    from goalreach_lab.study import find
    from goalreach_msgs_py.files import require_writable

    _check(options)
    if options.out is not None:
        require_writable(options.out)
    found: dict[str, Any] = {}
    rows: dict[str, list[BenchRow]] = {}
    for part in options.part:
        began_s = time.perf_counter()
        study = _studies(options)[part]()
        findings = find(study, options.results, measure=not options.as_it_is)
        if findings is not None:
            found[part], rows[part] = findings, study.rows(findings)
        print(f'{part}: {time.perf_counter() - began_s:.0f} s', flush=True)
    if options.figures is not None:
        from goalreach_lab.localization.figures import draw

        for file in draw(found, options.figures):
            print(file)
    if options.out is not None:
        _write(options, found, rows)
    return [row for part in rows.values() for row in part]


def _studies(options: argparse.Namespace) -> dict[str, Callable[[], Study]]:
    from goalreach_lab.localization import bound_study, drive_study, ros_input_study
    from goalreach_lab.localization.consistency_study import consistency_study
    from goalreach_lab.localization.kidnap_study import kidnap_study
    from goalreach_lab.localization.long_drive_study import long_drive_study
    from goalreach_lab.localization.speed_study import speed_study

    seed, jobs = options.seed, options.jobs
    return {
        'bound': lambda: bound_study.bound_study(
            images=options.bound_images, labelled=options.labelled_images, seed=seed, jobs=jobs
        ),
        'noise': lambda: drive_study.noise_study(
            robots=options.noise_robots, seed=seed, jobs=jobs
        ),
        'drives': lambda: drive_study.drive_study(
            starts=options.starts, robots=options.calibrated_robots, seed=seed, jobs=jobs
        ),
        'consistency': lambda: consistency_study(
            runs=options.runs, run_s=options.run_seconds, seed=seed, jobs=jobs
        ),
        'kidnap': lambda: kidnap_study(count=options.kidnaps, seed=seed, jobs=jobs),
        'long': lambda: long_drive_study(hours=options.hours, seed=seed, folder=options.results),
        'inputs': lambda: ros_input_study.input_study(seed=seed),
        'speed': lambda: speed_study(frames=options.frames, seed=seed),
    }


def _write(
    options: argparse.Namespace, found: dict[str, Any], rows: dict[str, list[BenchRow]]
) -> None:
    """Write the document; a part that was not measured is left out."""
    from goalreach_lab.localization.figures import links
    from goalreach_lab.localization.frame_log import WRONG_IN, WRONG_NEES
    from goalreach_lab.localization.ros_input_study import reasons
    from goalreach_lab.report import bench_table, goals_met, machine
    from goalreach_lab.template import table, write_document

    all_rows = [row for part in rows.values() for row in part]
    inputs = found.get('inputs')
    values: dict[str, object] = {
        'seed': options.seed,
        'machine': machine(),
        'goals_met': goals_met(all_rows),
        'wrong_in': f'{WRONG_IN:g}',
        'wrong_nees': f'{WRONG_NEES:g}',
        'reasons': None if inputs is None else table(('input', 'reason'), reasons(inputs)),
        **{part: bench_table(rows[part]) if part in rows else None for part in PARTS},
        **links(options.out, options.figures),
    }
    write_document(options.out, Path(__file__).with_name('document.md'), values)


def _check(options: argparse.Namespace) -> None:
    from goalreach_msgs_py.errors import ConfigurationError
    from goalreach_msgs_py.files import make_folder

    for name, (small, full, _) in _SIZES.items():
        key = name.replace('-', '_')
        if getattr(options, key) is None:
            setattr(options, key, full if options.full else small)
        if not getattr(options, key) > 0:
            raise ConfigurationError(f'--{name}', getattr(options, key), 'a number above 0')
    if options.jobs < 1:
        raise ConfigurationError('--jobs', options.jobs, 'a whole number >= 1')
    if options.as_it_is and options.results is None:
        raise ConfigurationError('--as-it-is', 'yes', 'together with --results DIR')
    if options.results is not None:
        make_folder(options.results)
