"""Mutations of valid input: wrong types, missing and extra fields, huge values, bad bytes."""

from collections.abc import Callable, Sequence
import copy
import math
from typing import Any, Final

import numpy as np

NASTY: Final[tuple[Any, ...]] = (
    None, True, False, 0, 1, -1, 2, 255, 2**31, 2**63, -(2**63), 10**400, 0.0, -0.0, 0.5, 1e-320,
    1e16, 1e300, -1e300, 1.8e308, math.nan, math.inf, -math.inf, '', ' ', 'x', 'nan', '1', '-1e9',
    'FRONT/NEAR', '\0', '\n', '\x1b[31m', '\u202e', '\U0001f916', 'a' * 3000, '../../etc',
    '!!python/none',     [], [[]], [None], [math.nan] * 3, [0] * 9, list(range(30)), {}, {'': 0},
    {'a': {'b': [1]}}, b'\0\xff',
)  # fmt: skip
"""Values that users give sooner or later."""

_ENCODINGS: Final = ('utf-16', 'utf-32', 'latin-1', 'utf-8-sig', 'cp500')
_DEEP: Final = 20_000
_LONG: Final = 200_000
_BOMB: Final = b'a: &a [x, x, x, x, x, x, x, x, x]\n' + b''.join(
    b'%c: &%c [%s]\n' % (c + 1, c + 1, b', '.join([b'*%c' % c] * 9)) for c in range(97, 107)
)
"""A small YAML document that is larger than any memory once its aliases are expanded."""


def nasty(rng: np.random.Generator) -> Any:
    """Return a copy of one of the `NASTY` values."""
    return copy.deepcopy(NASTY[rng.integers(len(NASTY))])


def mutate_value(value: Any, rng: np.random.Generator) -> Any:
    """Return a nested value with one to three mutations; a tuple becomes a list."""
    changed = copy.deepcopy(list(value) if isinstance(value, tuple) else value)
    for _ in range(int(rng.integers(1, 4))):
        changed = _mutate(changed, rng)
    return changed


def _mutate(value: Any, rng: np.random.Generator) -> Any:
    if isinstance(value, dict) and value and rng.random() > 0.05:  # noqa: PLR2004
        return _mutate_mapping(value, rng)
    if isinstance(value, list) and value and rng.random() > 0.1:  # noqa: PLR2004
        return _mutate_list(value, rng)
    if isinstance(value, (int, float)) and not isinstance(value, bool) and rng.random() < 0.3:  # noqa: PLR2004
        factors = (-1, 0, 1e3, 1e9, 1e300, 1e-300, 1.0000001)
        return _product(value, factors[rng.integers(len(factors))])
    return nasty(rng)


def _product(value: float, factor: float) -> float:
    try:
        return float(value) * float(factor)
    except OverflowError:
        return math.inf


def _mutate_mapping(value: dict[Any, Any], rng: np.random.Generator) -> dict[Any, Any]:
    keys = list(value)
    key = keys[rng.integers(len(keys))]
    chance = rng.random()
    if chance < 0.15:  # noqa: PLR2004
        del value[key]
    elif chance < 0.25:  # noqa: PLR2004
        value[f'{key}x' if chance < 0.2 else 7] = nasty(rng)  # noqa: PLR2004
    else:
        value[key] = _mutate(value[key], rng)
    return value


def _mutate_list(value: list[Any], rng: np.random.Generator) -> list[Any]:
    index = int(rng.integers(len(value)))
    chance = rng.random()
    if chance < 0.1:  # noqa: PLR2004
        del value[index]
    elif chance < 0.2:  # noqa: PLR2004
        value.insert(index, nasty(rng))
    else:
        value[index] = _mutate(value[index], rng)
    return value


def mutate_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Return the bytes of a file with one mutation."""
    return _BYTE_FAULTS[int(rng.integers(len(_BYTE_FAULTS)))](data, rng)


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 9)) if changed else 0):
        changed[rng.integers(len(changed))] = rng.integers(256)
    return bytes(changed)


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: rng.integers(len(data) + 1)]


def _drop(data: bytes, rng: np.random.Generator) -> bytes:
    begin, end = sorted(rng.integers(len(data) + 1, size=2).tolist())
    return data[:begin] + data[end:]


def _insert(data: bytes, rng: np.random.Generator) -> bytes:
    place = rng.integers(len(data) + 1)
    return data[:place] + rng.bytes(int(rng.integers(1, 64))) + data[place:]


def _repeat(data: bytes, rng: np.random.Generator) -> bytes:
    begin, end = sorted(rng.integers(len(data) + 1, size=2).tolist())
    return data[:end] + data[begin:end] * int(rng.integers(1, 4)) + data[end:]


def _encode(data: bytes, rng: np.random.Generator) -> bytes:
    text = data.decode('utf-8', errors='replace')
    return text.encode(_ENCODINGS[rng.integers(len(_ENCODINGS))], errors='replace')


def _other(_data: bytes, rng: np.random.Generator) -> bytes:
    choices: Sequence[Callable[[], bytes]] = (
        lambda: b'',
        lambda: b'\0' * 100,
        lambda: rng.bytes(int(rng.integers(2000))),
        lambda: b'[' * _DEEP,
        lambda: b'{"a":' * _DEEP,
        lambda: b'{' + b'"a": 1, ' * (_LONG // 100) + b'"b": 2}',
        lambda: b'9' * _LONG,
        lambda: b'"' + b'x' * _LONG + b'"',
        lambda: _BOMB,
        lambda: b'- ' * 500,
        lambda: b'\xef\xbb\xbf{}',
        lambda: b'---\n---\n',
        lambda: b'!!python/object/apply:os.system ["true"]',
    )
    return choices[int(rng.integers(len(choices)))]()


_BYTE_FAULTS: Final[tuple[Callable[[bytes, np.random.Generator], bytes], ...]] = (
    _flip, _flip, _flip, _cut, _drop, _insert, _repeat, _encode, _other,
)  # fmt: skip
