"""What the reproduction drives."""

from __future__ import annotations

from collections.abc import Sequence

from goalreach_evaluation.choices import arena_names, choose_arena, choose_policy
from goalreach_evaluation.starts import RunSeeds
from goalreach_lab.reproduction.study import Study
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena

_KINDS = ('random', 'border')
_OTHERS = ('crisp', 'fuzzy-eq3', 'fuzzy-as-printed')


def mode_studies(
    seed: int, *, fuzzy: int, harsh: int, others: int, others_harsh: int
) -> list[Study]:
    """Return the studies of the modes, all from the same starts, the most important first.

    Args:
        seed: Seed of learning, starts and noise.
        fuzzy: Fuzzy paths with nominal noise, of either kind of starts.
        harsh: Fuzzy paths with harsh noise, of either kind.
        others: Nominal paths of each other mode, of either kind.
        others_harsh: The same with harsh noise.
    """
    arena = Arena()
    policy = choose_policy(None, arena, RunSeeds.spawn(seed).training)

    def studies(noise: str, mode: str, paths: int) -> list[Study]:
        return [
            Study(
                name=f'{noise}-{mode}-{kind}-seed-{seed}',
                arena=arena,
                policy=policy,
                mode=mode,
                noise=noise,
                kind=kind,
                paths=paths,
                seed=seed,
            )
            for kind in _KINDS
        ]

    found = [*studies('nominal', 'fuzzy', fuzzy), *studies('harsh', 'fuzzy', harsh)]
    for noise, paths in (('nominal', others), ('harsh', others_harsh)):
        for mode in _OTHERS:
            found += studies(noise, mode, paths)
    return found


def arena_studies(seed: int, paths: int) -> list[Study]:
    """Return a study of each example arena, with a policy learned in it.

    Args:
        seed: Seed of learning, starts and noise.
        paths: Paths in each.
    """
    found = []
    for name in arena_names():
        arena = choose_arena(name)
        policy = choose_policy(None, arena, RunSeeds.spawn(seed).training)
        if name != 'paper':
            study = f'arena-{name}-seed-{seed}'
            found.append(Study(name=study, arena=arena, policy=policy, paths=paths, seed=seed))
    return found


def policy_studies(
    seed: int, policies: Sequence[Policy], paths: int, *, trials: int
) -> tuple[list[Study], list[Study]]:
    """Return studies of policies learned without noise, and of as many learned with images.

    Args:
        seed: Seed of the first; the others follow. The n-th of either drive the same starts.
        policies: Those learned with images.
        paths: Paths of each policy.
        trials: Trials in which they were learned, for the names.
    """
    arena = Arena()
    without: list[Study] = []
    images: list[Study] = []
    for number, policy in enumerate(policies):
        other = choose_policy(None, arena, RunSeeds.spawn(seed + number).training)
        for kind, driven, studies in (
            ('without', other, without),
            (f'images-{trials}', policy, images),
        ):
            name = f'learned-{kind}-seed-{seed + number}'
            studies.append(
                Study(name=name, arena=arena, policy=driven, paths=paths, seed=seed + number)
            )
    return without, images
