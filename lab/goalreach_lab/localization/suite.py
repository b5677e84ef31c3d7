"""How well the eyes localize: against the bound, over noise, over kidnappings, over a day."""

from __future__ import annotations

import argparse
from pathlib import Path
import time
from typing import Any

from goalreach_lab.row import BenchRow

SUMMARY = 'Localisation: the bound, driving, consistency, kidnapping, a day, bad inputs, speed'

_PARTS = ('bound', 'noise', 'drives', 'consistency', 'kidnap', 'long', 'inputs', 'speed')

_SIZES: dict[str, tuple[float, float, str]] = {
    'bound-images': (300, 4000, 'noisy images at each place, for each noise'),
    'labelled-images': (2, 20, 'how many of them are labelled too'),
    'noise-robots': (2, 4, 'robots that wander for a minute at each scale of noise'),
    'starts': (22, 200, "random starts beside the paper's 22"),
    'calibrated-robots': (1, 4, 'robots that wander for twelve minutes, calibrating'),
    'runs': (12, 100, 'runs of the consistency study'),
    'run-seconds': (20, 60, 'length of each of them'),
    'kidnaps': (60, 2000, 'kidnappings'),
    'hours': (0.05, 24, 'length of the long drive'),
    'frames': (400, 1000, 'images that are timed'),
}
"""Default, `--full`, and what it is."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    parser.add_argument(
        '--part', nargs='+', choices=_PARTS, default=list(_PARTS), help='what to measure'
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
        help='where finished parts are kept; what is there is not measured again',
    )
    parser.add_argument(
        '--as-it-is', action='store_true', help='use what is in --results, measure nothing'
    )
    parser.add_argument('--figures', type=Path, metavar='DIR', help='where the pictures go')
    parser.add_argument('--out', type=Path, metavar='FILE', help='the document, in Markdown')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure what is not there yet; draw and write what is asked for.

    Raises:
        GoalreachError: An option is refused or a file cannot be written.
    """
    from goalreach_lab.localization.parts import rows_of
    from goalreach_msgs_py.files import require_writable

    _check(options)
    if options.out is not None:
        require_writable(options.out)
    found = {part: _result(part, options) for part in options.part}
    results = {part: result for part, result in found.items() if result is not None}
    rows = {part: rows_of(part, result) for part, result in results.items()}
    if options.figures is not None:
        from goalreach_lab.localization.figures import draw

        for file in draw(results, options.figures):
            print(file)
    if options.out is not None:
        from goalreach_lab.localization.document import write_document

        write_document(options.out, rows, results, seed=options.seed, figures=options.figures)
    return [row for part in rows.values() for row in part]


def _check(options: argparse.Namespace) -> None:
    from goalreach_lab.reproduction.results_file import ResultsFolder
    from goalreach_msgs_py.errors import ConfigurationError

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
        ResultsFolder(options.results)


def _result(part: str, options: argparse.Namespace) -> dict[str, Any] | None:
    """Return what a part found: read where it is kept, else measured now."""
    from goalreach_lab.localization.parts import kept, measure, name_of
    from goalreach_lab.reproduction.results_file import ResultsFolder

    found = None if options.results is None else kept(part, options.results, options)
    if found is not None or options.as_it_is:
        return found
    began_s = time.perf_counter()
    found = measure(part, options)
    print(f'{part}: {time.perf_counter() - began_s:.0f} s', flush=True)
    if options.results is not None:
        ResultsFolder(options.results).write(name_of(part, options), found)
    return found
