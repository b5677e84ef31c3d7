"""The learners suite: what learners need, other grids, real-time sessions; docs/LEARNERS.md."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from goalreach_lab.options import DocumentOptions
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Study, find
from goalreach_msgs_py.options import option

SUMMARY = 'Paths and bumps that learners need; other grids; sessions over the graph'
PARTS: Final = ('curves', 'grids', 'sitting')


@dataclass(frozen=True, kw_only=True)
class Options(DocumentOptions):
    """Options of the suite."""

    part: tuple[str, ...] = option(PARTS, 'studies to run', choices=PARTS, metavar='PART')
    seeds: int = option(200, 'runs of each learner in each arena', minimum=1)
    image_seeds: int = option(20, 'runs of the other learners with images', minimum=1)
    starts: int = option(500, 'random starts in each grid', minimum=1)
    sittings: int = option(3, 'sessions over the graph, in real time', minimum=1)


def execute(options: Options) -> list[BenchRow]:
    """Measure the cases that are not finished; write the document and, beside it, its figures.

    Raises:
        GoalreachError: An option is refused or a file cannot be read or written.
    """
    found: dict[str, Any] = {}
    rows: list[BenchRow] = []
    for part in options.part:
        study = _study(part, options)
        findings = find(study, options.results, measure=not options.as_it_is)
        if findings is not None:
            found[part] = findings
            rows += study.rows(findings)
    if options.out is not None:
        _write(options, options.out, found)
    return rows


def _study(part: str, options: Options) -> Study:
    from goalreach_lab.learners.curves import curve_study
    from goalreach_lab.learners.grids import grid_study
    from goalreach_lab.learners.sitting import sitting_study

    seed, jobs = options.seed, options.jobs
    if part == 'curves':
        seeds, image_seeds = options.seeds, options.image_seeds
        return curve_study(seeds=seeds, image_seeds=image_seeds, seed=seed, jobs=jobs)
    if part == 'grids':
        return grid_study(starts=options.starts, seed=seed, jobs=jobs)
    return sitting_study(sittings=options.sittings, seed=seed)


def _write(options: Options, out: Path, found: dict[str, Any]) -> None:
    from goalreach_lab.learners import curves, figures
    from goalreach_lab.learners.grids import grid_table
    from goalreach_lab.learners.sitting import sitting_table
    from goalreach_lab.template import write_document

    learned, sittings = found.get('curves', {}), found.get('sitting', [])
    figures.draw(out.parent / 'figures', learned, sittings)
    values = {
        'seed': options.seed,
        'after': curves.AFTER,
        'after_images': curves.AFTER_IMAGES,
        'limit': curves.LIMIT,
        'curves': curves.curve_table(learned) if learned else None,
        'comparison': curves.comparison_table(learned) if learned else None,
        'grids': grid_table(found['grids']) if 'grids' in found else None,
        'sitting': sitting_table(sittings) if sittings else None,
    }
    write_document(out, Path(__file__).with_name('learners.md'), values)
