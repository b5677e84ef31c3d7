"""The extent of measurements and their spread."""

from goalreach_lab.speed.measurement import Budget, spread


def test_spread_of_both() -> None:
    assert spread([2.0, 1.0]) == 'from 1 to 2'
    assert spread([2.0, 1.0], [0.5]) == 'from 1 to 2; reference from 0.5 to 0.5'


def test_a_budget_scales_and_leaves_something() -> None:
    small, whole = Budget(seed=0, scale=0.01), Budget(seed=0, scale=1.0)
    assert (whole.count(500), small.count(500), small.count(7)) == (500, 5, 1)
    assert (whole.seconds(6.0), small.seconds(6.0)) == (6.0, 0.5)
    assert small.count(500, 44) == 44
