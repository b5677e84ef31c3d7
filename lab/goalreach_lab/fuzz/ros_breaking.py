"""Sound messages with one to three things wrong."""

from __future__ import annotations

from array import array
import math
from typing import Any, Final

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

_FLOATS: Final = (
    0.0, -0.0, 1.0, -1.0, math.pi, 1e-320, 1e9, -1e9, 1e16, 1e300, -1e300, 1.7e308, math.nan,
    math.inf, -math.inf,
)  # fmt: skip
_TEXTS: Final = ('', 'nan', 'inf', '-1e400', '1', 'x', '\0', '\n', 'FRONT/NEAR', 'a' * 3000)
_MOSTLY: Final = 0.6


def bad_message(sound: Any, rng: np.random.Generator) -> Any:
    """Return a copy of a message with one to three wrong values that fit its type."""
    message = _copy(sound)
    for _ in range(int(rng.integers(1, 4))):
        _break(message, rng)
    return message


def _break(message: Any, rng: np.random.Generator) -> None:
    """Put a wrong value into one field, however deep."""
    names = list(message.get_fields_and_field_types())
    name = names[rng.integers(len(names))]
    value = getattr(message, name)
    if hasattr(value, 'get_fields_and_field_types'):
        _break(value, rng)
    elif isinstance(value, bool):
        setattr(message, name, not value)
    elif isinstance(value, int):
        _set_first(message, name, rng.permutation([0, 1, -1, 127, 255, 65535, 2**31, 2**32 - 1]))
    elif isinstance(value, float):
        _set_first(message, name, [_FLOATS[rng.integers(len(_FLOATS))]])
    elif isinstance(value, bytes):
        _set_first(message, name, [rng.bytes(1)])
    elif isinstance(value, str):
        _set_first(message, name, [_TEXTS[rng.integers(len(_TEXTS))]])
    else:
        _break_sequence(value, rng)


def _set_first(message: Any, name: str, values: Any) -> None:
    """Set a field to the first of some values that its type takes."""
    for value in values:
        try:
            setattr(message, name, value.item() if isinstance(value, np.generic) else value)
        except (AssertionError, TypeError):
            continue
        return


def _holds_floats(value: Any, rng: np.random.Generator) -> bool:
    """Return whether a sequence is one of floats, most of the time."""
    return isinstance(value, array) and value.typecode in 'fd' and bool(rng.random() < _MOSTLY)


def _break_sequence(value: Any, rng: np.random.Generator) -> None:
    if not len(value):
        return
    index = int(rng.integers(len(value)))
    element = value[index]
    if hasattr(element, 'get_fields_and_field_types') and rng.random() < 0.8:  # noqa: PLR2004
        _break(element, rng)
    elif isinstance(value, np.ndarray) or _holds_floats(value, rng):
        value[index] = _FLOATS[rng.integers(len(_FLOATS))]
    elif rng.random() < 0.5:  # noqa: PLR2004
        del value[index]
    else:
        value.append(element)


def _copy(message: Any) -> Any:
    return deserialize_message(serialize_message(message), type(message))
