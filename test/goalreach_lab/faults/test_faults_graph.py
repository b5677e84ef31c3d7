"""A few faults of each sort, injected into a live stack."""

import pytest

from goalreach_lab.faults.judge import Verdict
from goalreach_lab.faults.kinds import choose_kinds
from goalreach_lab.faults.ros_campaign import inject_faults
import graphs

pytestmark = pytest.mark.graph


def test_faults_are_named_and_recovered_from() -> None:
    kinds = choose_kinds('state_estimator killed, /cmd_vel lost, all LEDs dark, second stack')
    verdicts: list[Verdict] = []
    inject_faults(kinds, domain=graphs.fresh_domain(), speed=1.0, seed=3, keep=verdicts.append)
    assert [verdict.kind for verdict in verdicts] == [kind.name for kind in kinds]
    for verdict in verdicts:
        assert verdict.recovery_s is not None, verdict
        assert verdict.report, verdict
        assert verdict.bumps == verdict.wrong == 0, verdict
