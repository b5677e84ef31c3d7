"""The stack ends with its launcher, and the next one is not disturbed; dead parts stop it."""

import signal

import pytest

from goalreach_lab.faults.ros_campaign import measure_stops
from goalreach_lab.faults.starts import run_rounds
import graphs

pytestmark = pytest.mark.graph


def test_no_process_survives_its_launcher_and_the_next_start_drives() -> None:
    cases = [{'round': number} for number in range(3)]
    finished = list(run_rounds(cases, domain=graphs.fresh_domain(), seed=0))
    assert [case for case, _ in finished] == cases
    names = [signal.Signals(number).name for number in (2, 15, 9)]
    assert [result['signal'] for _, result in finished] == names
    for _, result in finished:
        assert result['drove'], result['output']
        assert result['survivors'] == 0


def test_a_dead_controller_or_localizer_stops_the_robot_from_full_speed() -> None:
    cases = [{'number': 0}, {'number': 1}]
    finished = list(measure_stops(cases, domain=graphs.fresh_domain(), speed=1.0, seed=1))
    nodes = [result['node'] for _, result in finished]
    assert nodes == ['goal_reaching_controller', 'landmark_localizer']
    # It is at rest after 0.5 s: at the tick of 0.52 s. The last command may be older than the end.
    assert all(0.4 < result['taken_s'] <= 0.56 for _, result in finished), finished
