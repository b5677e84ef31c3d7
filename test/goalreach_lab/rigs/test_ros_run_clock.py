"""The rate of a graph's clock, compared with the simulator's reports of the same time."""

import numpy as np
import pytest

from goalreach_lab.rigs.ros_run_clock import clock_rate, measure_clock_rate
from goalreach_msgs_py.errors import GoalreachError
from graphs import fresh_domain


def test_the_rate_is_compared_with_the_reports_of_the_same_time() -> None:
    # Ten seconds at twice real time, five at 1.5 (reported at their end), five at 2.
    walls_s = np.arange(0.0, 20.01, 0.02)
    sims_s = np.interp(walls_s, [0.0, 10.0, 15.0, 20.0], [0.0, 20.0, 27.5, 37.5])
    ticks = list(zip((100.0 + walls_s).tolist(), sims_s.tolist(), strict=True))
    rate = clock_rate(ticks, [(98.0, 0.3), (115.0, 1.5), (123.0, 0.2)], 2.0)
    assert rate.measured == pytest.approx(37.5 / 20.0)
    assert rate.reported == pytest.approx(37.5 / 20.0)
    silent = clock_rate(ticks, [], 2.0)
    assert silent.measured == pytest.approx(37.5 / 20.0)
    assert silent.reported == 2.0


def test_a_clock_that_stands_has_no_rate() -> None:
    with pytest.raises(GoalreachError, match='stopped ticking'):
        clock_rate([(1.0, 2.0)], [], 1.0)


@pytest.mark.graph
def test_the_clock_of_a_graph_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', str(fresh_domain()))
    rate = measure_clock_rate(1.0, 2.0, 1)
    assert 0.5 < rate.measured < 1.1
    assert rate.ticks > 10
