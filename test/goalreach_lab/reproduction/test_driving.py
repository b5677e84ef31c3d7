import argparse
import math

import pytest

from goalreach_lab.reproduction.driving import configure, distance_to_goal, execute
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Pose2


def test_distance_to_goal_by_hand() -> None:
    regions = Arena().regions  # the goal is x 1.1811 ... 2.3749, y 0 ... 1.6891

    def from_point(x_m: float, y_m: float) -> float:
        return distance_to_goal(Pose2(x_m=x_m, y_m=y_m, heading_rad=0.0), regions)

    assert from_point(0.1811, 1.0) == pytest.approx(1.0)
    assert from_point(2.0, 3.6891) == pytest.approx(2.0)
    assert from_point(2.3749 + 0.3, 1.6891 + 0.4) == pytest.approx(0.5)
    assert from_point(1.5, 1.0) == 0.0


def options(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument('--seed', type=int, default=0)
    configure(parser)
    return parser.parse_args(arguments)


def test_rows_of_a_few_paths() -> None:
    rows = {row.name: row for row in execute(options('--starts', '2', '--noise', 'none'))}
    assert len(rows) == 20
    assert rows['fuzzy: goal reached'].met is True
    assert rows['fuzzy: largest change of the commanded heading in a step'].met is True
    assert rows['fuzzy: time to the goal, mean'].reference == pytest.approx(
        rows['crisp: time to the goal, mean'].ours
    )
    assert not math.isnan(rows['crisp: length over the shortest path, mean'].ours)


def test_refuses_no_starts() -> None:
    with pytest.raises(ConfigurationError, match='--starts = 0'):
        execute(options('--starts', '0'))
