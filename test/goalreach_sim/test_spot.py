import math

import numpy as np
import pytest

from goalreach_sim.camera_renderer import add_light, pixel_shares, spot_window


def test_shares_by_hand() -> None:
    # sigma = 1, centred on pixel 5: erf(0.5 / sqrt 2) = 0.382925, next 0.241730.
    shares = pixel_shares(5.0, 1.0, 4, 7)
    assert shares == pytest.approx([0.241730, 0.382925, 0.241730], abs=1e-6)


@pytest.mark.parametrize('centre_px', [5.0, 5.37, 4.5])
def test_shares_keep_flux_and_centre(centre_px: float) -> None:
    shares = pixel_shares(centre_px, 1.2, -20, 31)
    assert shares.sum() == pytest.approx(1.0, abs=1e-12)
    assert (shares * np.arange(-20, 31)).sum() == pytest.approx(centre_px, abs=1e-12)


def test_window_reaches_to_where_the_spot_is_dark() -> None:
    rows, columns = spot_window(100.2, 50.7, 1.5, 1000.0, (480, 640))
    peak_dn = 1000.0 / (2 * math.pi * 1.5**2)
    for edge, centre in (
        (rows.start - 1, 50.7),
        (rows.stop, 50.7),
        (columns.start - 1, 100.2),
        (columns.stop, 100.2),
    ):
        assert peak_dn * math.exp(-((edge - centre) ** 2) / (2 * 1.5**2)) < 0.05


@pytest.mark.parametrize(('u_px', 'v_px'), [(-50.0, 10.0), (10.0, 900.0), (1e6, 1e6)])
def test_nothing_outside_the_image(u_px: float, v_px: float) -> None:
    rows, columns = spot_window(u_px, v_px, 1.2, 1000.0, (480, 640))
    assert (rows.stop - rows.start, columns.stop - columns.start) == (0, 0)


def test_window_is_cut_at_the_border() -> None:
    rows, columns = spot_window(0.0, 479.0, 1.2, 1000.0, (480, 640))
    assert rows.stop == 480
    assert columns.start == 0
    assert rows.start < 479
    assert columns.stop > 1


def test_light_rounds_and_saturates() -> None:
    window = np.array([[10, 10], [200, 255]], dtype=np.uint8)
    add_light(window, np.array([[0.4, 0.6], [54.0, 900.0]]))
    assert window.tolist() == [[10, 11], [254, 255]]
