import pytest

from goalreach_learning.controller_config import MissionConfig, PathOrder
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Pose2

STARTS = (1.0, 2.0, 0.5, 3.0, 4.0, -0.5)
FIRST = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.5)
SECOND = Pose2(x_m=3.0, y_m=4.0, heading_rad=-0.5)


def test_paths_take_the_starts_in_turn_trial_after_trial() -> None:
    mission = MissionConfig(starts=STARTS, paths=4)
    assert [mission.path_order(path) for path in range(5)] == [
        PathOrder(path=0, trial=0, start=FIRST),
        PathOrder(path=1, trial=0, start=SECOND),
        PathOrder(path=2, trial=1, start=FIRST),
        PathOrder(path=3, trial=1, start=SECOND),
        None,
    ]


def test_a_resumed_path_begins_where_the_robot_is() -> None:
    mission = MissionConfig(starts=STARTS, first_path=3, resume=True)
    assert mission.path_order(3) == PathOrder(path=3, trial=1, start=None)
    assert mission.path_order(4) == PathOrder(path=4, trial=2, start=FIRST)


def test_without_starts_the_first_path_begins_where_the_robot_is_and_others_wait() -> None:
    mission = MissionConfig()
    assert mission.path_order(0) == PathOrder(path=0, trial=0, start=None)
    assert mission.path_order(7) == PathOrder(path=7, trial=7, start=None, waits=True)


def test_where_a_service_places_the_robot_no_path_waits() -> None:
    mission = MissionConfig(placement_service='/dock/leave')
    assert mission.path_order(7) == PathOrder(path=7, trial=7, start=None)


def test_without_starts_a_trial_has_as_many_paths_as_told() -> None:
    mission = MissionConfig(paths_per_trial=22, placement_service='/dock/leave')
    orders = [mission.path_order(path) for path in (0, 21, 22, 439)]
    assert [order.trial for order in orders if order] == [0, 0, 1, 19]


def test_a_start_has_three_numbers() -> None:
    with pytest.raises(ConfigurationError, match='three numbers for each start'):
        MissionConfig(starts=(1.0, 2.0))
