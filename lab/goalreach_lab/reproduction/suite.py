"""The reproduction suite: every number of REPRODUCTION.md, and the document itself."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from goalreach_lab.options import DocumentOptions
from goalreach_lab.reproduction.driving_study import Condition, DrivenPath, to_goal
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Study, find
from goalreach_msgs_py.options import option

SUMMARY = 'Measure every claim of the paper and write REPRODUCTION.md'


_size = partial(option, minimum=1)


@dataclass(frozen=True, kw_only=True)
class Options(DocumentOptions):
    """Options of the suite."""

    results: Path = option(
        Path('reproduction'),
        'folder of the results of finished cases, which are not measured again',
        metavar='DIR',
    )
    fuzzy: int = _size(2000, 'fuzzy paths with nominal noise, for random and for border starts')
    harsh: int = _size(500, 'fuzzy paths with harsh noise, for random and for border starts')
    others: int = _size(200, 'nominal paths of each other mode, for random and border starts')
    others_harsh: int = _size(100, 'the same with harsh noise')
    arenas: int = _size(220, 'paths in each example arena')
    policy_paths: int = _size(440, 'paths of each policy learned with and without images')
    seeds: int = _size(10_000, 'learning seeds')
    variation_seeds: int = _size(2000, 'learning seeds for each changed parameter')
    blend_starts: int = _size(2000, 'starts of a point without noise, for each blend')
    image_policies: int = _size(2, 'policies learned with images in the loop')
    image_trials: int = _size(20, 'trials of each of them')


def execute(options: Options) -> list[BenchRow]:
    """Measure the cases that are not finished, and write the document.

    Raises:
        GoalreachError: An option is refused or a file cannot be read or written.
    """
    from goalreach_lab.reproduction import document
    from goalreach_lab.reproduction.blend_study import blend_study
    from goalreach_lab.reproduction.learning import learning_study
    from goalreach_lab.template import write_document
    from goalreach_msgs_py.files import make_folder, require_writable

    make_folder(options.results)
    if options.out is not None:
        require_writable(options.out)
    seed, jobs = options.seed, options.jobs
    learning = learning_study(
        seeds=options.seeds, variation_seeds=options.variation_seeds, seed=seed, jobs=jobs
    )
    learned = learning.rows(_find(options, learning) or [])
    blends = _find(options, blend_study(starts=options.blend_starts, seed=seed, jobs=jobs))
    driven, arenas = _drive(options)
    values = {
        'seed': seed,
        **document.learning_values(learned),
        **document.blend_values(blends),
        **document.driving_values(driven),
        **_compare_policies(options),
        'arenas': document.arena_table(arenas) if any(arenas.values()) else None,
        **document.parameter_values(),
    }
    if options.out is not None:
        write_document(options.out, Path(__file__).with_name('reproduction.md'), values)
    return [*learned, *_rows(driven)]


def _find(options: Options, study: Study) -> Any:
    return find(study, options.results, measure=not options.as_it_is)


def _paths(options: Options, name: str, conditions: list[Condition]) -> dict[str, Any]:
    """Return the paths of conditions by their names; the conditions are driven if needed."""
    from goalreach_lab.reproduction.driving_study import driving_study

    study = driving_study(conditions, name=name, seed=options.seed, jobs=options.jobs)
    return dict(_find(options, study) or {condition.name: [] for condition in conditions})


def _drive(
    options: Options,
) -> tuple[dict[tuple[str, str, str], list[DrivenPath]], dict[str, list[DrivenPath]]]:
    """Return the paths by noise, mode and kind of starts, and by arena."""
    from goalreach_lab.reproduction.driving_study import arena_conditions, mode_conditions

    modes = mode_conditions(
        options.seed,
        fuzzy=options.fuzzy,
        harsh=options.harsh,
        others=options.others,
        others_harsh=options.others_harsh,
    )
    arenas = arena_conditions(options.seed, options.arenas)
    paths = _paths(options, 'driving', [*modes.values(), *arenas.values()])
    return (
        {key: paths[condition.name] for key, condition in modes.items()},
        {name: paths[condition.name] for name, condition in arenas.items()},
    )


def _compare_policies(options: Options) -> dict[str, object]:
    """Return the placeholders of the policies learned with images, and without."""
    from goalreach_lab.reproduction.document import from_same_starts, learned_table
    from goalreach_lab.reproduction.driving_study import image_learning_study, policy_conditions

    policies = _find(
        options,
        image_learning_study(
            count=options.image_policies,
            trials=options.image_trials,
            seed=options.seed,
            jobs=options.jobs,
        ),
    )
    conditions = policy_conditions(policies or {}, options.policy_paths)
    paths = _paths(options, f'policies-{options.image_trials}', conditions)
    driven = [paths[one.name] for one in conditions]
    pairs = [from_same_starts(pair) for pair in zip(driven[::2], driven[1::2], strict=True)]
    without, images = ([path for pair in pairs for path in pair[k]] for k in (0, 1))
    return {
        'learned': learned_table(without, images) if without else None,
        'policies': len(policies or {}),
        'image_trials': options.image_trials,
    }


def _rows(driven: Mapping[tuple[str, str, str], list[DrivenPath]]) -> list[BenchRow]:
    least = {'nominal': 100.0, 'harsh': 99.5}
    return [
        _goal_row(
            f'{mode}, {noise} noise, {kind} starts',
            paths,
            least[noise] if mode == 'fuzzy' else None,
        )
        for (noise, mode, kind), paths in driven.items()
        if paths
    ]


def _goal_row(name: str, paths: Sequence[DrivenPath], least: float | None) -> BenchRow:
    """Return the row of the share of paths that reached the goal.

    Args:
        name: What was driven.
        paths: Its paths, at least one.
        least: Goal of the row in percent, or None.
    """
    reached, title = len(to_goal(paths)), f'{name}: goal reached'
    lost = Counter(path.outcome for path in paths if path.outcome != 'goal')
    note = ''.join(f'; {outcome} {count}' for outcome, count in sorted(lost.items()))
    return BenchRow.share(title, reached, len(paths), unit='% of paths', least=least, note=note)
