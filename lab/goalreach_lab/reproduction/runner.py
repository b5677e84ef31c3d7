"""Doing what is not done yet of a reproduction, on as many processes as wanted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
import multiprocessing

from goalreach_evaluation.sessions import EvaluationPlan, drive_session
from goalreach_lab.reproduction.image_learning import learn_with_images
from goalreach_lab.reproduction.results_file import ResultsFolder
from goalreach_lab.reproduction.study import DrivenPath, Study, driven_paths
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_msgs_py.arena import Arena


def drive_studies(
    studies: Sequence[Study],
    results: ResultsFolder,
    *,
    jobs: int,
    progress: Callable[[int], None],
) -> None:
    """Drive every session that is not there yet, and keep each as soon as it is done.

    Args:
        studies: What to drive.
        results: Where results are kept.
        jobs: Number of processes.
        progress: Called with 1 after each session.
    """
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(max_workers=jobs, mp_context=context) as pool:
        waiting: dict[Future[list[DrivenPath]], tuple[Study, int]] = {}
        for number, study in _missing(studies, results):
            waiting[pool.submit(_drive, study.plan(), number)] = (study, number)
        progress(sum(study.sessions for study in studies) - len(waiting))
        for done in as_completed(waiting):
            study, number = waiting[done]
            results.add_session(study.name, number, done.result())
            progress(1)


def _missing(studies: Sequence[Study], results: ResultsFolder) -> list[tuple[int, Study]]:
    """Return the sessions not there yet, the first of every study before the second of any."""
    missing: list[tuple[int, int, Study]] = []
    for order, study in enumerate(studies):
        there = results.sessions(study.name)
        missing += [(n, order, study) for n in range(study.sessions) if n not in there]
    missing.sort(key=lambda one: one[:2])
    return [(number, study) for number, _, study in missing]


def _drive(plan: EvaluationPlan, number: int) -> list[DrivenPath]:
    return driven_paths(drive_session(plan, number), plan.arena)


def paths_of(study: Study, results: ResultsFolder) -> list[DrivenPath]:
    """Return the paths of a study that were driven, in order."""
    sessions = results.sessions(study.name)
    numbers = [number for number in sorted(sessions) if number < study.sessions]
    return [path for number in numbers for path in sessions[number]]


def image_policies(
    count: int, trials: int, results: ResultsFolder, *, jobs: int, seed: int, learn: bool = True
) -> list[Policy]:
    """Return policies learned with images in the loop, learning those not there yet.

    Args:
        count: How many.
        trials: Trials of each.
        results: Where they are kept.
        jobs: Number of processes.
        seed: Seed of the first; the others follow.
        learn: Whether to learn those not there; without, only those there are returned.
    """
    arena = Arena()
    names = [f'images-{trials}-trials-seed-{seed + number}' for number in range(count)]
    missing = [name for name in names if not results.policy_path(name).exists()]
    if not learn:
        there = [name for name in names if name not in missing]
        return [read_policy(results.policy_path(name)) for name in there]
    seeds = [int(name.rpartition('-')[2]) for name in missing]
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(max_workers=jobs, mp_context=context) as pool:
        learned = {
            pool.submit(learn_with_images, arena, 'nominal', one, trials): name
            for name, one in zip(missing, seeds, strict=True)
        }
        for done in as_completed(learned):
            write_policy(results.policy_path(learned[done]), done.result())
    return [read_policy(results.policy_path(name)) for name in names]
