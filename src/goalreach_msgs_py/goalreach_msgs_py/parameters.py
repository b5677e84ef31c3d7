"""Configuration as frozen dataclasses whose fields know their meaning and their range.

One dataclass serves the pure core (which only sees values), the node (which declares each
field as a ROS parameter) and the documents. Nested dataclasses become dotted names.
"""

from __future__ import annotations

from collections.abc import Mapping
import dataclasses
from dataclasses import dataclass
import math
from typing import Any, TypeVar, cast

from goalreach_msgs_py.errors import ConfigurationError

ConfigT = TypeVar('ConfigT')
_KEY = 'goalreach'


@dataclass(frozen=True, kw_only=True)
class ParameterInfo:
    """What is known of one tunable value.

    Attributes:
        description: What the value means, with its unit and source.
        minimum: Smallest accepted value (of each element, for a sequence), or None.
        maximum: Largest accepted value, or None.
        choices: The accepted strings, or empty where any will do.
        length: Number of elements that a sequence must have, or None.
    """

    description: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    length: int | None = None

    def allowed(self, kind: str) -> str:
        """Return a phrase that names the accepted values, for an error message."""
        if self.choices:
            return 'one of ' + ', '.join(self.choices)
        size = '' if self.length is None else f'{self.length} numbers, each '
        if self.minimum is not None and self.maximum is not None:
            return f'{size}{kind} in [{self.minimum:g}, {self.maximum:g}]'
        if self.minimum is not None:
            return f'{size}{kind} >= {self.minimum:g}'
        if self.maximum is not None:
            return f'{size}{kind} <= {self.maximum:g}'
        return f'{size}{kind}'


def parameter(
    default: Any,  # noqa: ANN401 - the field's own annotation gives the type
    description: str,
    *,
    within: tuple[float | None, float | None] = (None, None),
    choices: tuple[str, ...] = (),
    length: int | None = None,
) -> Any:  # noqa: ANN401 - what dataclasses.field itself returns
    """Return a dataclass field that carries a `ParameterInfo`.

    Args:
        default: The default value: float, int, bool, str or a tuple of floats.
        description: What it means, with its unit and source.
        within: Smallest and largest accepted value, of each element for a tuple; None: any.
        choices: The accepted strings.
        length: Number of elements of a tuple.
    """
    info = ParameterInfo(
        description=description,
        minimum=within[0],
        maximum=within[1],
        choices=choices,
        length=length,
    )
    return dataclasses.field(default=default, metadata={_KEY: info})


class Configuration:
    """Base of configuration dataclasses: checks every field made by `parameter`.

    A subclass that checks more extends `__post_init__`.

    Raises:
        ConfigurationError: A value has the wrong type, is not finite, is out of its range or is
            not among its choices. The error names the field, the value and what is allowed.
    """

    def __post_init__(self) -> None:
        """Check every field."""
        for field in dataclasses.fields(cast('Any', self)):
            info = field.metadata.get(_KEY)
            if info is not None:
                _check(field.name, getattr(self, field.name), field.default, info)


def _check(name: str, value: object, default: object, info: ParameterInfo) -> None:
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise ConfigurationError(name, value, 'true or false')
    elif isinstance(default, str):
        if not isinstance(value, str) or (info.choices and value not in info.choices):
            raise ConfigurationError(name, value, info.allowed('a text'))
    elif isinstance(default, tuple):
        if not isinstance(value, tuple) or (info.length is not None and len(value) != info.length):
            raise ConfigurationError(name, value, info.allowed('a number'))
        for element in value:
            check_number(name, element, info, integer=False)
    else:
        check_number(name, value, info, integer=isinstance(default, int))


def check_number(name: str, value: object, info: ParameterInfo, *, integer: bool) -> None:
    """Check that a value is a finite number within the range of its field.

    Raises:
        ConfigurationError: It is not.
    """
    kind = 'a whole number' if integer else 'a number'
    accepted = (int,) if integer else (int, float)
    if isinstance(value, bool) or not isinstance(value, accepted) or not _is_finite(value):
        raise ConfigurationError(name, value, info.allowed(kind))
    low = info.minimum is not None and value < info.minimum
    high = info.maximum is not None and value > info.maximum
    if low or high:
        raise ConfigurationError(name, value, info.allowed(kind))


def parameter_infos(cls: type[object], prefix: str = '') -> dict[str, ParameterInfo]:
    """Return the `ParameterInfo` of every field of a configuration class, by dotted name."""
    infos: dict[str, ParameterInfo] = {}
    for field in dataclasses.fields(cast('Any', cls)):
        if _KEY in field.metadata:
            infos[prefix + field.name] = field.metadata[_KEY]
        elif dataclasses.is_dataclass(nested := field.default_factory):
            infos.update(parameter_infos(cast('type[object]', nested), f'{prefix}{field.name}.'))
    return infos


def flatten_config(config: object, prefix: str = '') -> dict[str, Any]:
    """Return the values of a configuration by dotted name, nested dataclasses opened."""
    values: dict[str, Any] = {}
    for field in dataclasses.fields(cast('Any', config)):
        value = getattr(config, field.name)
        if _KEY in field.metadata:
            values[prefix + field.name] = value
        elif dataclasses.is_dataclass(value):
            values.update(flatten_config(value, f'{prefix}{field.name}.'))
    return values


def build_config(cls: type[ConfigT], values: Mapping[str, Any], prefix: str = '') -> ConfigT:
    """Build a configuration from values by dotted name; what is missing keeps its default.

    Args:
        cls: The configuration dataclass.
        values: Values by dotted name. Lists become tuples, whole numbers become floats where
            the default is a float.
        prefix: Dotted prefix of `values` that belongs to `cls`.

    Raises:
        ConfigurationError: A value is refused; the field is named with its prefix.
    """
    arguments: dict[str, Any] = {}
    for field in dataclasses.fields(cast('Any', cls)):
        name = prefix + field.name
        if _KEY in field.metadata:
            if name in values:
                arguments[field.name] = _coerce(values[name], field.default)
        elif dataclasses.is_dataclass(nested := field.default_factory):
            arguments[field.name] = build_config(
                cast('type[Any]', nested), values, f'{prefix}{field.name}.'
            )
    try:
        return cls(**arguments)
    except ConfigurationError as error:
        if not prefix or error.field.startswith(prefix):
            raise
        raise ConfigurationError(prefix + error.field, error.value, error.allowed) from None


def _coerce(value: object, default: object) -> object:
    if isinstance(default, tuple) and not isinstance(value, str) and hasattr(value, '__iter__'):
        return tuple(_as_float(v) for v in value)
    return _as_float(value) if isinstance(default, float) else value


def _as_float(value: object) -> object:
    """Return a whole number as a float, where it fits one; all else as it is."""
    if type(value) is not int:
        return value
    try:
        return float(value)
    except OverflowError:
        return value


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number that fits no float
        return False
