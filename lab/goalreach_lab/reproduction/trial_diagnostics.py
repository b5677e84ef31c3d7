"""What changed from one trial to the next: is it still learning?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from goalreach_learning.policy import Policy


@dataclass(frozen=True, kw_only=True)
class TrialDiagnostics:
    """One trial in numbers.

    Attributes:
        trial: Trial, from 0.
        temperature: Boltzmann temperature in it.
        updates: Actions learned from.
        largest_q_change: Largest change of a Q-value.
        mean_best_q: Mean over the eight learning regions of the best value.
        policy_changes: Regions whose best action changed.
        untried: State-action pairs never tried so far, of 64.
    """

    trial: int
    temperature: float
    updates: int
    largest_q_change: float
    mean_best_q: float
    policy_changes: int
    untried: int


def diagnose_trial(
    before: Policy, after: Policy, *, trial: int, temperature: float
) -> TrialDiagnostics:
    """Return what one trial changed.

    Args:
        before: What was known at its start.
        after: What was known at its end.
        trial: Trial, from 0.
        temperature: Boltzmann temperature in it.
    """
    learning = np.ones((3, 3), dtype=np.bool_)
    learning[after.regions.goal] = False
    regions = [(i, j) for i in range(3) for j in range(3)]
    return TrialDiagnostics(
        trial=trial,
        temperature=temperature,
        updates=int(after.visits.sum() - before.visits.sum()),
        largest_q_change=float(np.abs(after.q - before.q).max()),
        mean_best_q=float(after.q.max(axis=-1)[learning].mean()),
        policy_changes=sum(before.greedy_action(r) != after.greedy_action(r) for r in regions),
        untried=int((after.visits[learning] == 0).sum()),
    )
