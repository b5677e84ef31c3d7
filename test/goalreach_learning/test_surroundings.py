import math

import pytest

from goalreach_learning.behaviors import Surroundings


@pytest.mark.parametrize(
    ('numbers', 'base_deg', 'expected_deg'),
    [
        ([], 0.0, []),
        ([5], 0.0, [90.0]),
        ([4, 5, 6], -90.0, [0.0]),
        ([4, 5], -90.0, [-9.0]),
        ([19, 0, 1], 90.0, [90.0]),
        ([0, 1, 5, 6], 0.0, [9.0, 99.0]),
        (range(20), 0.0, []),
    ],
)
def test_azimuths_by_hand(numbers: list[int], base_deg: float, expected_deg: list[float]) -> None:
    pressed = [number in numbers for number in range(20)]
    azimuths = Surroundings(pressed=pressed).touched_rad(math.radians(base_deg))
    assert [math.degrees(a) for a in azimuths] == pytest.approx(expected_deg, abs=1e-9)


def test_without_bumpers_nothing_is_touched() -> None:
    assert Surroundings().touched_rad(0.0) == ()
