"""Waiting without blocking the executor."""

import pytest

from goalreach_learning.ros.placement import ConditionWait
import graphs

pytestmark = pytest.mark.graph


@pytest.mark.parametrize('holds', [False, True])
def test_an_action_runs_once_as_soon_as_the_condition_holds(*, holds: bool) -> None:
    ran: list[int] = []
    holding = [holds]
    with graphs.onlooker(graphs.fresh_domain()) as (node, serve_until):
        wait = ConditionWait(node, lambda: holding[0], 'waiting')
        wait.run(lambda: ran.append(1))
        assert bool(ran) is holds
        assert serve_until(lambda: bool(ran), 0.2) is holds
        holding[0] = True
        assert serve_until(lambda: bool(ran), 10.0)
        assert not serve_until(lambda: len(ran) > 1, 0.2)
