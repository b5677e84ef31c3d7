"""The localization suite: accuracy, consistency, robustness, speed; docs/LOCALIZATION.md."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
import time
from typing import Any

from goalreach_lab.options import DocumentOptions
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Study, find
from goalreach_msgs_py.options import option

SUMMARY = 'Accuracy, consistency, robustness and speed of the localizer'

PARTS = ('bound', 'noise', 'drives', 'consistency', 'kidnap', 'long', 'inputs', 'speed')

_SIZES = {
    'bound_images': (300, 4000), 'labelled_images': (2, 20), 'noise_robots': (2, 4),
    'starts': (22, 200), 'calibrated_robots': (1, 4), 'runs': (12, 100),
    'run_seconds': (20.0, 60.0), 'kidnaps': (60, 2000), 'hours': (0.05, 24.0),
    'frames': (400, 1000),
}  # fmt: skip
"""Default size of each study, and that of docs/LOCALIZATION.md."""


def _size(name: str, description: str) -> Any:
    small, full = _SIZES[name]
    text = f'{description} (default: {small:g}, with --full {full:g})'
    return option(None, text, above=0.0, metavar='N')


@dataclass(frozen=True, kw_only=True)
class Options(DocumentOptions):
    """Options of the suite."""

    part: tuple[str, ...] = option(PARTS, 'studies to run', choices=PARTS, metavar='PART')
    full: bool = option(False, 'use the sizes of docs/LOCALIZATION.md')
    bound_images: int | None = _size('bound_images', 'noisy images at each place and noise')
    labelled_images: int | None = _size('labelled_images', 'how many of them are labelled too')
    noise_robots: int | None = _size('noise_robots', 'robots at each scale of the noise')
    starts: int | None = _size('starts', "random starts in addition to the paper's 22")
    calibrated_robots: int | None = _size('calibrated_robots', 'robots that calibrate themselves')
    runs: int | None = _size('runs', 'runs of the consistency study')
    run_seconds: float | None = _size('run_seconds', 'length of each of them, s')
    kidnaps: int | None = _size('kidnaps', 'kidnappings')
    hours: float | None = _size('hours', 'length of the long drive, h')
    frames: int | None = _size('frames', 'images that are timed')
    figures: Path | None = option(
        None, 'folder of the figures, if not beside --out', metavar='DIR'
    )

    def size(self, name: str) -> Any:
        """Return the size of a study: the one given, else the default."""
        given = getattr(self, name)
        return _SIZES[name][self.full] if given is None else given


def execute(options: Options) -> list[BenchRow]:
    """Measure the cases that are not finished; draw the figures and write the document.

    Raises:
        GoalreachError: An option is refused or a file cannot be read or written.
    """
    from goalreach_msgs_py.files import make_folder, require_writable

    if options.results is not None:
        make_folder(options.results)
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
    beside = None if options.out is None else options.out.parent / 'figures'
    if figures := options.figures or beside:
        from goalreach_lab.localization.figures import draw

        for file in draw(found, figures):
            print(file)
    if options.out is not None:
        _write(options.out, options, found, rows)
    return [row for part in rows.values() for row in part]


def _studies(options: Options) -> dict[str, Callable[[], Study]]:
    from goalreach_lab.localization import bound_study, drive_study, ros_input_study
    from goalreach_lab.localization.consistency_study import consistency_study
    from goalreach_lab.localization.kidnap_study import kidnap_study
    from goalreach_lab.localization.long_drive_study import long_drive_study
    from goalreach_lab.localization.speed_study import speed_study

    seed, jobs, size = options.seed, options.jobs, options.size
    return {
        'bound': lambda: bound_study.bound_study(
            images=size('bound_images'), labelled=size('labelled_images'), seed=seed, jobs=jobs
        ),
        'noise': lambda: drive_study.noise_study(
            robots=size('noise_robots'), seed=seed, jobs=jobs
        ),
        'drives': lambda: drive_study.drive_study(
            starts=size('starts'), robots=size('calibrated_robots'), seed=seed, jobs=jobs
        ),
        'consistency': lambda: consistency_study(
            runs=size('runs'), run_s=size('run_seconds'), seed=seed, jobs=jobs
        ),
        'kidnap': lambda: kidnap_study(count=size('kidnaps'), seed=seed, jobs=jobs),
        'long': lambda: long_drive_study(hours=size('hours'), seed=seed, folder=options.results),
        'inputs': lambda: ros_input_study.input_study(seed=seed),
        'speed': lambda: speed_study(frames=size('frames'), seed=seed),
    }


def _write(
    out: Path, options: Options, found: dict[str, Any], rows: dict[str, list[BenchRow]]
) -> None:
    """Write the document; a part that was not measured is left out."""
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
    }
    write_document(out, Path(__file__).with_name('localization.md'), values)
