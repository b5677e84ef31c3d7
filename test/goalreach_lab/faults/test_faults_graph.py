"""A few faults of each sort, injected into a live stack."""

import pytest

from goalreach_lab.faults.kinds import choose_kinds
from goalreach_lab.faults.ros_campaign import inject_faults
import graphs

pytestmark = pytest.mark.graph


def test_faults_are_named_and_recovered_from() -> None:
    kinds = choose_kinds('state_estimator killed, /cmd_vel lost, all LEDs dark, second stack')
    outcomes = list(inject_faults(kinds, domain=graphs.fresh_domain(), speed=1.0, seed=3))
    assert [outcome.kind for outcome in outcomes] == [kind.name for kind in kinds]
    for outcome in outcomes:
        assert outcome.recovery_s is not None, outcome
        assert outcome.report, outcome
        assert outcome.bumps == outcome.overconfident == 0, outcome
