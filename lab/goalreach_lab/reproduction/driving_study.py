"""Many paths with images in the loop, over modes, noise, starts, arenas and policies."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
import functools
import math
from typing import Final

import numpy as np

from goalreach_evaluation.choices import arena_names, choose_arena, choose_policy
from goalreach_evaluation.drive import InProcessDrive
from goalreach_evaluation.evaluation import SESSION_PATHS, EvaluationPlan, drive_session
from goalreach_evaluation.path_metrics import PathResult
from goalreach_evaluation.starts import RunSeeds, border_starts, random_starts
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import Pose2

OUTCOMES: Final = ('goal', 'bump', 'false-goal', 'timeout')
KINDS: Final = ('random', 'border')
MODES: Final = ('fuzzy', 'crisp', 'fuzzy-eq3', 'fuzzy-as-printed')


@dataclass(frozen=True, kw_only=True)
class Condition:
    """What a number of paths have in common.

    Attributes:
        name: Name of the condition in the results.
        arena: The arena.
        policy: The policy to drive.
        mode: How the heading is chosen.
        noise: Errors of the sensors.
        kind: 'random' starts over the floor, or starts at the 'border'.
        paths: Number of paths.
        seed: Seed of starts and noise.
    """

    name: str
    arena: Arena
    policy: Policy
    mode: str = 'fuzzy'
    noise: NoiseModel = field(default_factory=lambda: noise_preset('nominal'))
    kind: str = 'random'
    paths: int
    seed: int

    @property
    def cases(self) -> list[Case]:
        """The cases of the condition: sessions of up to 22 paths of one robot."""
        firsts = range(0, self.paths, SESSION_PATHS)
        return [
            {
                'condition': self.name,
                'session': number,
                'paths': min(SESSION_PATHS, self.paths - first),
            }
            for number, first in enumerate(firsts)
        ]

    def plan(self) -> EvaluationPlan:
        """Return the plan of the condition; with more paths it begins with the same ones."""
        seeds = RunSeeds.spawn(self.seed)
        draw = random_starts if self.kind == 'random' else border_starts
        return EvaluationPlan(
            arena=self.arena,
            noise=self.noise,
            policy=self.policy,
            controller=ControllerConfig(mode=self.mode),
            starts=draw(self.arena, self.paths, np.random.default_rng(seeds.starts)),
            seed=seeds.simulator,
        )


@dataclass(frozen=True, kw_only=True)
class DrivenPath:
    """The measures of a path.

    Attributes:
        number: Which of the starts of its condition it began at.
        outcome: One of `OUTCOMES`.
        duration_s: Duration.
        length_m: Length.
        turning_deg: Total turning.
        step_deg: Largest change of the commanded heading in a control step, once under way.
        shortest_m: Length of the shortest path into the goal.
        error_rms_m: Error of the estimated position; None where there was no confident estimate.
    """

    number: int
    outcome: str
    duration_s: float
    length_m: float
    turning_deg: float
    step_deg: float
    shortest_m: float
    error_rms_m: float | None

    @classmethod
    def of(cls, path: PathResult, regions: RegionMap, number: int) -> 'DrivenPath':
        """Return the measures of a driven path."""
        return cls(
            number=number,
            outcome=path.outcome,
            duration_s=round(path.duration_s, 3),
            length_m=round(path.length_m, 4),
            turning_deg=round(math.degrees(path.turning_rad), 3),
            step_deg=round(math.degrees(path.max_heading_step_rad), 3),
            shortest_m=round(distance_to_goal(path.start, regions), 4),
            error_rms_m=round(path.pose_error_m['rms'], 5) if path.pose_error_m else None,
        )


def distance_to_goal(start: Pose2, regions: RegionMap) -> float:
    """Return the length of the shortest path into the goal region, metres.

    Args:
        start: Where the path starts.
        regions: The region map; the floor is convex, so the path is straight.
    """
    x_low, y_low, x_high, y_high = regions.bounds(regions.goal)
    return math.hypot(
        max(x_low - start.x_m, 0.0, start.x_m - x_high),
        max(y_low - start.y_m, 0.0, start.y_m - y_high),
    )


def to_goal(paths: Sequence[DrivenPath]) -> list[DrivenPath]:
    """Return the paths that reached the goal."""
    return [path for path in paths if path.outcome == 'goal']


def driving_study(conditions: Sequence[Condition], *, name: str, seed: int, jobs: int) -> Study:
    """Return the study of the paths of conditions; its findings are the paths by condition.

    The first session of every condition is driven before the second of any.

    Args:
        conditions: The conditions.
        name: Name of the study.
        seed: Seed of the conditions, for the settings.
        jobs: Number of processes.
    """
    by_name = {condition.name: condition for condition in conditions}
    cases = [case for condition in conditions for case in condition.cases]
    cases.sort(key=lambda case: int(case['session']))
    return Study(
        name=name,
        key=('condition', 'session', 'paths'),
        settings={'seed': seed},
        cases=cases,
        measure=per_case(functools.partial(_drive, conditions=by_name), jobs=jobs),
        analyse=functools.partial(_analyse, names=tuple(by_name)),
    )


def _drive(case: Case, *, conditions: Mapping[str, Condition]) -> Result:
    condition = conditions[case['condition']]
    session = drive_session(condition.plan(), case['session'])
    paths = enumerate(session.paths, start=case['session'] * SESSION_PATHS)
    return {
        'driven': [asdict(DrivenPath.of(path, condition.arena.regions, n)) for n, path in paths]
    }


def _analyse(results: Sequence[Result], *, names: Sequence[str]) -> dict[str, list[DrivenPath]]:
    paths: dict[str, list[DrivenPath]] = {name: [] for name in names}
    for result in results:
        driven = enumerate(result['driven'], start=result['session'] * SESSION_PATHS)
        paths[result['condition']] += [DrivenPath(**{'number': n, **one}) for n, one in driven]
    return paths


def mode_conditions(
    seed: int, *, fuzzy: int, harsh: int, others: int, others_harsh: int
) -> dict[tuple[str, str, str], Condition]:
    """Return the conditions of noise, mode and kind of starts, the most important first.

    Args:
        seed: Seed of learning, starts and noise.
        fuzzy: Fuzzy paths with nominal noise, for each kind of starts.
        harsh: Fuzzy paths with harsh noise, for each kind.
        others: Nominal paths of each other mode, for each kind.
        others_harsh: The same with harsh noise.
    """
    arena = Arena()
    policy = choose_policy(None, arena, RunSeeds.spawn(seed).training)
    first, *rest = MODES
    counts = {('nominal', first): fuzzy, ('harsh', first): harsh}
    counts |= {('nominal', mode): others for mode in rest}
    counts |= {('harsh', mode): others_harsh for mode in rest}
    return {
        (noise, mode, kind): Condition(
            name=f'{noise} {mode} {kind}',
            arena=arena,
            policy=policy,
            mode=mode,
            noise=noise_preset(noise),
            kind=kind,
            paths=paths,
            seed=seed,
        )
        for (noise, mode), paths in counts.items()
        for kind in KINDS
    }


def arena_conditions(seed: int, paths: int) -> dict[str, Condition]:
    """Return a condition for each example arena, with a policy learned in it.

    Args:
        seed: Seed of learning, starts and noise.
        paths: Paths in each.
    """
    arenas = {name: choose_arena(name) for name in arena_names() if name != 'paper'}
    training = RunSeeds.spawn(seed).training
    return {
        name: Condition(
            name=f'arena {name}',
            arena=arena,
            policy=choose_policy(None, arena, training),
            paths=paths,
            seed=seed,
        )
        for name, arena in arenas.items()
    }


def policy_conditions(policies: Mapping[int, Policy], paths: int) -> list[Condition]:
    """Return conditions of policies learned with images, and without noise with the same seeds.

    Args:
        policies: Policies learned with images, by seed; both drive from the same starts.
        paths: Paths of each policy.
    """
    arena = Arena()
    conditions = []
    for seed, policy in policies.items():
        without = choose_policy(None, arena, RunSeeds.spawn(seed).training)
        for kind, driven in (('without noise', without), ('with images', policy)):
            conditions.append(
                Condition(
                    name=f'learned {kind} {seed}',
                    arena=arena,
                    policy=driven,
                    paths=paths,
                    seed=seed,
                )
            )
    return conditions


def image_learning_study(*, count: int, trials: int, seed: int, jobs: int) -> Study:
    """Return the study that learns policies with images in the loop.

    Its findings are the policies by seed.

    Args:
        count: Number of policies.
        trials: Trials of each.
        seed: Seed of the first; the others follow.
        jobs: Number of processes.
    """
    return Study(
        name='image-policies',
        key=('seed', 'trials'),
        cases=[{'seed': seed + number, 'trials': trials} for number in range(count)],
        measure=per_case(_learn_with_images, jobs=jobs),
        analyse=lambda results: {
            result['seed']: Policy(
                q=np.array(result['q'], dtype=np.float64),
                visits=np.array(result['visits'], dtype=np.int64),
                regions=Arena().regions,
            )
            for result in results
        },
    )


def _learn_with_images(case: Case) -> Result:
    """Return the policy of a learning phase in which every step goes through images."""
    arena, trials = Arena(), case['trials']
    drive = InProcessDrive(
        arena=arena,
        noise=noise_preset('nominal'),
        policy=Policy.unlearned(arena.regions),
        controller=ControllerConfig(
            mode='crisp', learn=True, learning=LearningConfig(trials=trials)
        ),
        seed=np.random.SeedSequence(RunSeeds.spawn(case['seed']).simulator),
    )
    for path in range(trials * len(arena.starts)):
        trial, start = divmod(path, len(arena.starts))
        drive.drive(arena.starts[start], path=path, trial=trial)
    learned = drive.learned
    return {'q': learned.q.tolist(), 'visits': learned.visits.tolist()}
