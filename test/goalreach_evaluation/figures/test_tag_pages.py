from __future__ import annotations

from dataclasses import replace
import math

import cv2
from matplotlib.backends.backend_agg import FigureCanvasAgg
import numpy as np
import pytest

from goalreach_evaluation.figures.tag_pages import tag_page, tag_pages
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.tags import Tag
from goalreach_perception.measurement_model import Optics
from goalreach_perception.tag_detection import TagDetector

DPI = 60
FINER = 4
TAG = Tag(id=11, size_m=0.14, x_m=0.6, y_m=0.0, z_m=1.3, facing_rad=math.pi / 2)


@pytest.mark.parametrize(('size_m', 'width_mm'), [(0.14, 210), (0.2, 297), (0.3, 420)])
def test_a_printed_tag_has_its_number_and_size(size_m: float, width_mm: float) -> None:
    tag = replace(TAG, size_m=size_m)
    figure = tag_page(tag, '36h11')
    assert figure.get_figwidth() * 25.4 == pytest.approx(width_mm)
    figure.set_dpi(FINER * DPI)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    drawn = canvas.buffer_rgba()  # type: ignore[no-untyped-call]
    fine = np.ascontiguousarray(np.asarray(drawn)[..., 0])
    part, area = 1 / FINER, cv2.INTER_AREA
    page = cv2.resize(fine, None, fx=part, fy=part, interpolation=area).astype(np.uint8)
    height_px, width_px = page.shape
    camera = PinholeCamera(
        width_px=width_px, height_px=height_px, fx_px=500.0, fy_px=500.0, cx_px=0.0, cy_px=0.0
    )
    found = TagDetector([tag], '36h11', 0, 0.0).find(page, Optics(camera))
    assert len(found.leds) == 4
    sides_px = np.hypot(*(np.roll(found.pixels_px, -1, axis=0) - found.pixels_px).T)
    assert sides_px * 0.0254 / DPI == pytest.approx([size_m] * 4, abs=0.0002)
    (text,) = figure.axes[0].texts
    assert f'Tag {tag.id} of 36h11' in text.get_text()
    assert 'x = 0.6 m, y = 0 m, 1.3 m above the floor' in text.get_text()
    ruler = figure.axes[0].lines[-1].get_xdata()
    assert np.ptp(np.asarray(ruler)) == 100


def test_every_tag_has_a_page_and_one_too_large_is_refused() -> None:
    tags = (TAG, replace(TAG, id=12, x_m=1.0))
    pages = tag_pages(Arena(tags=tags))
    assert pages.startswith(b'%PDF')
    assert pages.count(b'/Type /Page\n') + pages.count(b'/Type /Page ') == 2
    with pytest.raises(ConfigurationError, match='size_m of tag 11'):
        tag_page(replace(TAG, size_m=1.0), '36h11')
