import math

import pytest

from goalreach_lab.reproduction.driving import Options, execute
from goalreach_msgs_py.errors import ConfigurationError


def test_rows_of_a_few_paths() -> None:
    rows = {row.name: row for row in execute(Options(starts=2, noise='none'))}
    assert len(rows) == 20
    assert rows['fuzzy: goal reached'].met is True
    assert rows['fuzzy: largest change of the commanded heading in a step'].met is True
    assert rows['fuzzy: time to the goal, mean'].reference == pytest.approx(
        rows['crisp: time to the goal, mean'].ours
    )
    assert not math.isnan(rows['crisp: excess over the shortest path, mean'].ours)


def test_refuses_no_starts() -> None:
    with pytest.raises(ConfigurationError, match='--starts = 0'):
        Options(starts=0)
