"""Pages with AprilTags for a printer, to scale."""

from io import BytesIO
import math
from typing import Final

from matplotlib import rc_context
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.tags import Tag, tag_pattern

PAPERS_MM: Final = {
    'A4': (210, 297), 'A3': (297, 420), 'A2': (420, 594), 'A1': (594, 841), 'A0': (841, 1189)
}  # fmt: skip
_BORDER_MM, _FOOT_MM, _RULER_MM = 8.0, 40.0, 100
"""What printers leave white; the part of a page below the tag; the length of its ruler."""
_MM_PER_IN: Final = 25.4


def tag_pages(arena: Arena) -> bytes:
    """Return a PDF with a page for each tag of an arena: tag, ruler, and where it hangs.

    Raises:
        ConfigurationError: A tag is larger than the largest paper.
    """
    content = BytesIO()
    with rc_context({'font.family': 'DejaVu Sans'}):
        pages = PdfPages(content, metadata={'CreationDate': None, 'Title': arena.name})
        with pages:
            for tag in arena.tags:
                page = tag_page(tag, arena.tag_family)
                pages.savefig(page)  # type: ignore[no-untyped-call]
    return content.getvalue()


def tag_page(tag: Tag, family: str) -> Figure:
    """Return the page of a tag, on the smallest paper that holds it with its white margin."""
    pattern = tag_pattern(family, tag.id)
    side_mm = 1000.0 * tag.size_m * len(pattern) / (len(pattern) - 2)
    fits = [
        (name, width_mm, height_mm)
        for name, (width_mm, height_mm) in PAPERS_MM.items()
        if side_mm <= min(width_mm - 2 * _BORDER_MM, height_mm - 2 * _BORDER_MM - _FOOT_MM)
    ]
    if not fits:
        raise ConfigurationError(f'size_m of tag {tag.id}', tag.size_m, 'one that A0 holds')
    name, width_mm, height_mm = fits[0]
    figure = Figure(figsize=(width_mm / _MM_PER_IN, height_mm / _MM_PER_IN))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.axis('off')
    left, low = 0.5 * (width_mm - side_mm), height_mm - _BORDER_MM - side_mm
    place = left, left + side_mm, low, low + side_mm
    axes.imshow(pattern, cmap='gray', interpolation='none', extent=place, aspect='auto')
    axes.set(xlim=(0, width_mm), ylim=(0, height_mm))
    start, base = 0.5 * (width_mm - _RULER_MM), _BORDER_MM + 24.0
    for mm in range(_RULER_MM + 1):
        tick_mm = 4.0 if mm % 10 == 0 else 2.0
        axes.plot([start + mm] * 2, [base, base + tick_mm], color='black', linewidth=0.4)
    axes.plot([start, start + _RULER_MM], [base] * 2, color='black', linewidth=0.4)
    facing_deg = math.degrees(tag.facing_rad)
    text = (
        f'This ruler is {_RULER_MM} mm long, the black square {1000 * tag.size_m:g} mm wide: '
        f'print on {name} at 100 %.\nTag {tag.id} of {family}. Its centre hangs at x = '
        f'{tag.x_m:g} m, y = {tag.y_m:g} m, {tag.z_m:g} m above the floor,\n'
        f'upright, facing {facing_deg:g} deg (0: +x, 90: +y).'
    )
    axes.text(0.5 * width_mm, base - 4.0, text, ha='center', va='top', fontsize=8)
    return figure
