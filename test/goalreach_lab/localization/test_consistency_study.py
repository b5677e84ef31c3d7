import pytest

from goalreach_lab.localization.consistency_study import mean_band


def test_the_band_of_a_mean_over_runs() -> None:
    # chi-square with 300 degrees of freedom: 253.91 and 349.87 at 2.5 and 97.5 %
    assert mean_band(3, 100) == pytest.approx((2.5391, 3.4987), abs=1e-4)
    assert mean_band(3, 1, probability=0.9) == pytest.approx((0.3518, 7.8147), abs=1e-4)
