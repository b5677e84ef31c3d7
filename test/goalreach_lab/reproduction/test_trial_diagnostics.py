import itertools

import numpy as np
import pytest

from goalreach_lab.reproduction.trial_diagnostics import TrialDiagnostics, diagnose_trial
from goalreach_learning.policy import Policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.regions import RegionMap


def test_counts_what_changed() -> None:
    before = Policy.unlearned(RegionMap())
    q, visits = before.q.copy(), before.visits.copy()
    q[0, 0, 0], visits[0, 0, 0] = 0.8, 3
    after = Policy(q=q, visits=visits, regions=RegionMap())
    assert diagnose_trial(before, after, trial=2, temperature=0.5) == TrialDiagnostics(
        trial=2,
        temperature=0.5,
        updates=3,
        largest_q_change=0.8,
        mean_best_q=0.1,
        policy_changes=1,
        untried=63,
    )


def test_a_learning_phase_settles(arena: Arena) -> None:
    known = [Policy.unlearned(arena.regions)]
    result = train(arena, rng=np.random.default_rng(0), on_trial=lambda _, p: known.append(p))
    told = [
        diagnose_trial(a, b, trial=k, temperature=0.0)
        for k, (a, b) in enumerate(itertools.pairwise(known))
    ]
    assert len(told) == 20
    assert sum(trial.updates for trial in told) == result.options
    assert told[0].policy_changes == 8
    assert sum(trial.policy_changes for trial in told[-3:]) == 0
    assert told[-1].mean_best_q == pytest.approx((3 * 1.0 + 3 * 0.9 + 2 * 0.81) / 8, abs=0.02)
