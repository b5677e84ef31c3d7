"""Every number of REPRODUCTION.md, and the document itself."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import time
from typing import TYPE_CHECKING, Any

from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_lab.reproduction.results_file import ResultsFolder
    from goalreach_lab.reproduction.study import DrivenPath, Study


SUMMARY = 'Measure every claim of the paper and write REPRODUCTION.md; goes on where it ended'

_BUDGETS = {
    'fuzzy': (2000, 'fuzzy paths with nominal noise, of random and as many of border starts'),
    'harsh': (500, 'fuzzy paths with harsh noise, of random and as many of border starts'),
    'others': (200, 'nominal paths of each other mode, of random and as many of border starts'),
    'others-harsh': (100, 'the same with harsh noise'),
    'arenas': (220, 'paths in each example arena'),
    'policy-paths': (440, 'paths of each policy that is compared for how it was learned'),
    'seeds': (10_000, 'learning seeds'),
    'variation-seeds': (2000, 'learning seeds for each changed parameter'),
    'blend-starts': (2000, 'starts of a point without noise, for each blend'),
    'image-policies': (2, 'policies learned with images in the loop'),
    'image-trials': (20, 'trials of each of them'),
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    for name, (default, text) in _BUDGETS.items():
        parser.add_argument(f'--{name}', type=int, default=default, metavar='N', help=text)
    parser.add_argument('--jobs', type=int, default=1, help='processes')
    parser.add_argument(
        '--results',
        type=Path,
        default=Path('reproduction'),
        metavar='DIR',
        help='where finished parts are kept; what is there is not measured again',
    )
    parser.add_argument(
        '--as-it-is',
        action='store_true',
        help='write the document from what is there, drive nothing',
    )
    parser.add_argument('--out', type=Path, metavar='FILE', help='the document, in Markdown')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure what is not there yet, and write the document.

    Raises:
        GoalreachError: An option is refused or a file cannot be written.
    """
    from goalreach_lab.reproduction.document import Evidence, write_document
    from goalreach_lab.reproduction.results_file import ResultsFolder
    from goalreach_msgs_py.errors import ConfigurationError
    from goalreach_msgs_py.files import require_writable

    for name in (*_BUDGETS, 'jobs'):
        value = getattr(options, name.replace('-', '_'))
        if value < 1:
            raise ConfigurationError(f'--{name}', value, 'a whole number >= 1')
    if options.out is not None:
        require_writable(options.out)
    results = ResultsFolder(options.results)
    began_s = time.perf_counter()
    learning = _learning(options, results)
    blends = _blends(options, results)
    driven, arenas = _drive(options, results)
    policies, without, images = _compare_policies(options, results)
    evidence = Evidence(
        learning=learning,
        blends=blends,
        driven=driven,
        arenas=arenas,
        without=without,
        images=images,
        policies=policies,
        image_trials=options.image_trials,
        seed=options.seed,
    )
    if options.out is not None:
        write_document(options.out, evidence)
    print(f'took {time.perf_counter() - began_s:.0f} s beside what was there already')
    return _rows(driven)


def _learning(options: argparse.Namespace, results: ResultsFolder) -> list[dict[str, Any]]:
    from goalreach_lab.reproduction import learning

    name = f'learning-{options.seeds}-{options.variation_seeds}-seed-{options.seed}'
    found = results.read(name)
    if found is None:
        asked = argparse.Namespace(
            seeds=options.seeds,
            variation_seeds=options.variation_seeds,
            phases=50,
            seed=options.seed,
        )
        found = [row.to_json() for row in learning.execute(asked)]
        results.write(name, found)
    return list(found)


def _blends(options: argparse.Namespace, results: ResultsFolder) -> dict[str, Any]:
    from goalreach_evaluation.choices import choose_policy
    from goalreach_evaluation.starts import RunSeeds
    from goalreach_lab.reproduction.equation_3 import study_blends
    from goalreach_msgs_py.arena import Arena

    name = f'blends-{options.blend_starts}-seed-{options.seed}'
    found = results.read(name)
    if found is None:
        arena, seeds = Arena(), RunSeeds.spawn(options.seed)
        policy = choose_policy(None, arena, seeds.training)
        found = study_blends(arena, policy, options.blend_starts, seeds.starts)
        results.write(name, found)
    return dict(found)


def _drive(
    options: argparse.Namespace, results: ResultsFolder
) -> tuple[dict[tuple[str, str, str], list[DrivenPath]], dict[str, list[DrivenPath]]]:
    from goalreach_lab.reproduction.plans import arena_studies, mode_studies
    from goalreach_lab.reproduction.runner import paths_of

    studies = mode_studies(
        options.seed,
        fuzzy=options.fuzzy,
        harsh=options.harsh,
        others=options.others,
        others_harsh=options.others_harsh,
    )
    arenas = arena_studies(options.seed, options.arenas)
    _run([*studies, *arenas], options, results)
    driven = {(s.noise, s.mode, s.kind): paths_of(s, results) for s in studies}
    return driven, {study.arena.name: paths_of(study, results) for study in arenas}


def _compare_policies(
    options: argparse.Namespace, results: ResultsFolder
) -> tuple[int, list[DrivenPath], list[DrivenPath]]:
    from goalreach_lab.reproduction.plans import policy_studies
    from goalreach_lab.reproduction.runner import image_policies, paths_of

    policies = image_policies(
        options.image_policies,
        options.image_trials,
        results,
        jobs=options.jobs,
        seed=options.seed,
        learn=not options.as_it_is,
    )
    without, images = policy_studies(
        options.seed, policies, options.policy_paths, trials=options.image_trials
    )
    _run([*without, *images], options, results)
    return (
        len(policies),
        [path for study in without for path in paths_of(study, results)],
        [path for study in images for path in paths_of(study, results)],
    )


def _run(studies: Sequence[Study], options: argparse.Namespace, results: ResultsFolder) -> None:
    from goalreach_evaluation.terminal import progress_bar
    from goalreach_lab.reproduction.runner import drive_studies

    if options.as_it_is:
        return
    total = sum(study.sessions for study in studies)
    with progress_bar('driving', total=total) as advance:
        drive_studies(studies, results, jobs=options.jobs, progress=advance)


def _rows(driven: dict[tuple[str, str, str], list[DrivenPath]]) -> list[BenchRow]:
    from goalreach_evaluation.path_metrics import wilson_interval

    rows = []
    for (noise, mode, kind), paths in driven.items():
        if not paths:
            continue
        reached = sum(path.outcome == 'goal' for path in paths)
        low, high = wilson_interval(reached, len(paths))
        bound = 100.0 if noise == 'nominal' else 99.5
        rows.append(
            BenchRow(
                name=f'{mode}, {noise} noise, {kind} starts: goal reached',
                unit='% of paths',
                ours=100.0 * reached / len(paths),
                goal=Goal(of='ours', relation='>=', bound=bound) if mode == 'fuzzy' else None,
                n=len(paths),
                note=f'95 % interval {100 * low:.2f} to {100 * high:.2f} %',
            )
        )
    return rows
