"""The stack ends with its launcher, and the next one is not disturbed; dead parts stop it."""

import signal

import numpy as np
import pytest

from goalreach_lab.faults.ros_stops import measure_stops
from goalreach_lab.faults.start_rounds import Round, run_rounds
import graphs

pytestmark = pytest.mark.graph


def test_no_process_survives_its_launcher_and_the_next_start_drives() -> None:
    rounds: list[Round] = []
    run_rounds(3, domain=graphs.fresh_domain(), rng=np.random.default_rng(0), keep=rounds.append)
    names = [signal.Signals(number).name for number in (2, 15, 9)]
    assert [one.signal for one in rounds] == names
    for one in rounds:
        assert one.drove, one.said
        assert one.survivors == 0


def test_a_dead_controller_or_localizer_stops_the_robot_from_full_speed() -> None:
    taken: list[tuple[str, float]] = []
    measure_stops(
        2,
        domain=graphs.fresh_domain(),
        speed=1.0,
        seed=1,
        keep=lambda part, taken_s: taken.append((part, taken_s)),
    )
    assert [part.partition(' ')[0] for part, _ in taken] == [
        'goal_reaching_controller',
        'landmark_localizer',
    ]
    # It stands at 0.5 s: at the tick of 0.52 s. The last command may be older than the end.
    assert all(0.4 < taken_s <= 0.56 for _, taken_s in taken), taken
