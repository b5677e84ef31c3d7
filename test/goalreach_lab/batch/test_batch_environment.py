import numpy as np
import pytest

from goalreach_lab.batch.batch_environment import BatchEnvironment
from goalreach_learning.environment import OptionEnvironment
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena


@pytest.mark.parametrize('overshoot_m', [0.0, 0.05, 0.4])
def test_is_the_single_environment_number_for_number(arena: Arena, overshoot_m: float) -> None:
    single = OptionEnvironment(arena, overshoot_m=overshoot_m)
    batch = BatchEnvironment(single)
    rng = np.random.default_rng(2)
    n = 2000
    low = BODY_RADIUS_M
    x_m = rng.uniform(low, arena.width_m - low, n)
    y_m = rng.uniform(low, arena.length_m - low, n)
    x_m[:200] = arena.regions.x_borders_m[1]  # on a border, and against a wall
    y_m[100:300] = low
    action = rng.integers(0, 8, n)
    i, j = batch.regions_at(x_m, y_m)
    end = batch.advance(x_m, y_m, i, j, action)
    for k in range(n):
        region = (int(i[k]), int(j[k]))
        assert region == arena.regions.region_at(x_m[k], y_m[k])
        expected = single.advance(float(x_m[k]), float(y_m[k]), region, int(action[k]))
        found = (end.x_m[k], end.y_m[k], (end.i[k], end.j[k]), end.bumped[k], end.length_m[k])
        assert found == expected
