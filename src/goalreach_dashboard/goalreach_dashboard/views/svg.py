"""Small pieces of SVG and text, shared by the views."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import math
from typing import Final

HIDDEN: Final = {'visibility': 'hidden'}
VISIBLE: Final = {'visibility': 'visible'}
_CM: Final = 100.0


def cm(x_m: float, y_m: float, length_m: float) -> tuple[float, float]:
    """Return a point of `map` in the picture: centimetres, y downward from the far wall."""
    return _CM * x_m, _CM * (length_m - y_m)


def translate(x_m: float, y_m: float, length_m: float) -> str:
    """Return the transform that moves a drawing to a point of `map`."""
    x, y = cm(x_m, y_m, length_m)
    return f'translate({x:.1f} {y:.1f})'


def rotate(angle_rad: float) -> str:
    """Return the transform that turns a drawing counter-clockwise."""
    return f'rotate({-math.degrees(angle_rad):.1f})'


def arrow(name: str, angle_rad: float, length: float, more: str = '') -> str:
    """Return a line with an arrow's head from the origin.

    Args:
        name: CSS class.
        angle_rad: Where it points, counter-clockwise from +x.
        length: Its length in the picture.
        more: Further attributes.
    """
    x, y = length * math.cos(angle_rad), -length * math.sin(angle_rad)
    return f'<line class="{name}" x2="{x:.1f}" y2="{y:.1f}" marker-end="url(#head)"{more}/>'


def lines(points: Iterable[tuple[float, float]]) -> str:
    """Return the `points` attribute of a polyline."""
    return ' '.join(f'{x:.1f},{y:.1f}' for x, y in points)


def metres(value_m: float) -> str:
    """Return a length for people, to the millimetre."""
    return f'{value_m:.3f} m'


def degrees(angle_rad: float) -> str:
    """Return an angle for people, to a tenth of a degree."""
    return f'{math.degrees(angle_rad):.1f}°'


View = Mapping[str, Mapping[str, str]]
"""By name of an element, its attributes; `text` and `html` are its content."""

_WORTH_APPENDING: Final = 32


def difference(new: View, old: View) -> dict[str, dict[str, str]]:
    """Return what turns a page that shows `old` into one that shows `new`.

    An attribute that has only grown at its end comes as `+name` with what is to be appended.
    """
    patch: dict[str, dict[str, str]] = {}
    for name, attributes in new.items():
        before = old.get(name, {})
        if attributes is before:
            continue
        changes: dict[str, str] = {}
        for key, value in attributes.items():
            shown = before.get(key)
            if value == shown:
                continue
            if _has_grown(key, value, shown):
                changes[f'+{key}'] = value[len(shown or '') :]
            else:
                changes[key] = value
        if changes:
            patch[name] = changes
    return patch


def _has_grown(key: str, value: str, shown: str | None) -> bool:
    return (
        shown is not None
        and key not in ('text', 'html')
        and len(shown) > _WORTH_APPENDING
        and value.startswith(shown)
    )
