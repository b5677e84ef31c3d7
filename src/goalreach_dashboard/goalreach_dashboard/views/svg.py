"""Views as differences of attributes, and what they share: fragments, transforms and figures."""

from collections.abc import Mapping
from functools import lru_cache
import math
from typing import Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from jinja2.environment import TemplateModule

View = Mapping[str, Mapping[str, str]]
"""Attributes by the name of an element; `text` and `html` are its content."""

Elements = dict[str, dict[str, str]]
"""A view under construction."""

HIDDEN: Final = {'visibility': 'hidden'}
VISIBLE: Final = {'visibility': 'visible'}
_CM_PER_M: Final = 100.0
_MIN_LENGTH_TO_APPEND: Final = 32


def cm(x_m: float, y_m: float, length_m: float) -> tuple[float, float]:
    """Return a point of `map` in the picture: centimetres, y downward from the far wall."""
    return _CM_PER_M * x_m, _CM_PER_M * (length_m - y_m)


def polar(length: float, angle_rad: float) -> tuple[float, float]:
    """Return the end of a line from the origin, y downward; the angle is counter-clockwise."""
    return length * math.cos(angle_rad), -length * math.sin(angle_rad)


@lru_cache(maxsize=1)
def _fragments() -> TemplateModule:
    environment = Environment(
        loader=PackageLoader('goalreach_dashboard', 'static'),
        autoescape=True,
        undefined=StrictUndefined,
    )
    environment.filters['r'] = '{:.1f}'.format
    environment.globals['polar'] = polar
    return environment.get_template('fragments.html').module


def fragment(name: str, *values: object) -> dict[str, str]:
    """Return the content of an element: a macro of `static/fragments.html` with its values."""
    return {'html': str(getattr(_fragments(), name)(*values))}


def translate(x_m: float, y_m: float, length_m: float) -> str:
    """Return the transform that moves a drawing to a point of `map`."""
    x, y = cm(x_m, y_m, length_m)
    return f'translate({x:.1f} {y:.1f})'


def rotate(angle_rad: float) -> str:
    """Return the transform that rotates a drawing counter-clockwise."""
    return f'rotate({-math.degrees(angle_rad):.1f})'


def metres(value_m: float) -> str:
    """Return a length to the millimetre, with its unit."""
    return f'{value_m:.3f} m'


def degrees(angle_rad: float) -> str:
    """Return an angle to a tenth of a degree, with its unit."""
    return f'{math.degrees(angle_rad):.1f}°'


def difference(new: View, old: View) -> Elements:
    """Return what turns a page that shows `old` into one that shows `new`.

    An attribute that has only grown at its end is given as `+name` with the text to append.
    """
    patch: Elements = {}
    for name, attributes in new.items():
        shown = old.get(name, {})
        changes: dict[str, str] = {}
        for key, value in attributes.items():
            before = shown.get(key)
            if value == before:
                continue
            if before is not None and _has_grown(key, value, before):
                changes[f'+{key}'] = value[len(before) :]
            else:
                changes[key] = value
        if changes:
            patch[name] = changes
    return patch


def _has_grown(key: str, value: str, before: str) -> bool:
    is_attribute = key not in ('text', 'html')
    return is_attribute and len(before) > _MIN_LENGTH_TO_APPEND and value.startswith(before)
