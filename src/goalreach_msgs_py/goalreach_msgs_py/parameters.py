"""Configuration as frozen dataclasses whose fields know their meaning and their range.

One dataclass serves the pure core (which only sees values), the node (which declares each
field as a ROS parameter) and the documents. Nested dataclasses become dotted names.
"""

from collections.abc import Mapping, Sequence
import dataclasses
from dataclasses import dataclass
import itertools
from operator import attrgetter
from typing import Any, TypeGuard, TypeVar, cast

from goalreach_msgs_py.errors import ConfigurationError

ConfigT = TypeVar('ConfigT')
_KEY = 'goalreach'
_LARGEST = 2.0**1023
"""Largest number accepted, half the largest float. Chosen."""
KINDS = {int: 'a whole number', float: 'a number'}
"""Types of numbers in messages."""


@dataclass(frozen=True, kw_only=True)
class ParameterInfo:
    """What is known of one tunable value.

    Attributes:
        description: What the value means, with its unit and source.
        minimum: Smallest accepted value (of each element, for a sequence), or None.
        maximum: Largest accepted value, or None.
        above: Number that a value must exceed, or None.
        choices: The accepted strings, or empty where any will do.
        length: Number of elements that a sequence must have, or None.
    """

    description: str
    minimum: float | None = None
    maximum: float | None = None
    above: float | None = None
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
    **settings: Any,  # noqa: ANN401 - attributes of ParameterInfo
) -> Any:  # noqa: ANN401 - what dataclasses.field itself returns
    """Return a dataclass field that carries a `ParameterInfo`.

    Args:
        default: The default value: float, int, bool, str or a tuple of floats.
        description: What it means, with its unit and source.
        within: Smallest and largest accepted value, of each element for a tuple; None: any.
        settings: Attributes `choices` and `length` of `ParameterInfo`.
    """
    low, high = within
    info = ParameterInfo(description=description, minimum=low, maximum=high, **settings)
    return dataclasses.field(default=default, metadata={_KEY: info})


class Configuration:
    """Base of configuration dataclasses: checks every field made by `parameter`.

    A subclass that checks more extends `__post_init__`.

    Raises:
        ConfigurationError: A value has the wrong type, is not finite, is out of its range or is
            not among its choices. The error names the field, the value and what is allowed.
    """

    def __post_init__(self) -> None:
        for field in dataclasses.fields(cast('Any', self)):
            info = field.metadata.get(_KEY)
            if info is not None:
                _check(field.name, getattr(self, field.name), field.default, info)


def _check(name: str, value: object, default: object, info: ParameterInfo) -> None:
    if not isinstance(default, tuple):
        check_value(name, value, info, type(default))
        return
    if not isinstance(value, tuple) or (info.length is not None and len(value) != info.length):
        raise ConfigurationError(name, value, info.allowed('a number'))
    for element in value:
        check_value(name, element, info, float)


def check_value(name: str, value: object, info: ParameterInfo, kind: type) -> None:
    """Check a value, or an element of a sequence, against the type and the range of its field.

    A float may be given as a whole number. A type other than bool, str, int and float is accepted.

    Raises:
        ConfigurationError: It is of another type, not finite, out of range or not a choice.
    """
    if kind is bool and not isinstance(value, bool):
        raise ConfigurationError(name, value, 'true or false')
    bad_choice = info.choices and value not in info.choices
    if kind is str and (not isinstance(value, str) or bad_choice):
        raise ConfigurationError(name, value, info.allowed('a text'))
    if kind in KINDS:
        good = is_number(value) and (kind is float or isinstance(value, int))
        low, high = info.minimum, info.maximum
        number = cast('float', value)
        if not good or (low is not None and number < low) or (high is not None and number > high):
            raise ConfigurationError(name, value, info.allowed(KINDS[kind]))
        if info.above is not None and not number > info.above:
            raise ConfigurationError(name, value, f'greater than {info.above:g}')


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a finite number that fits a float, and not a bool."""
    is_real = isinstance(value, (int, float)) and not isinstance(value, bool)
    return is_real and abs(cast('float', value)) <= _LARGEST


def numbers_of(value: object, shape: Sequence[int | None], place: str) -> tuple[float, ...]:
    """Return the numbers of nested lists of a document in order.

    The shape is the lengths of the lists, the outermost first, None for any; it is empty for one
    number. The place is named in messages.

    Raises:
        ConfigurationError: A list has another length, or an element is no finite number.
    """
    if not shape:
        if not is_number(value):
            raise ConfigurationError(place, value, 'a finite number')
        return (float(value),)
    if not isinstance(value, list) or shape[0] not in {None, len(value)}:
        size = '' if shape[0] is None else f'{shape[0]} '
        kind = 'lists' if len(shape) > 1 else 'numbers'
        raise ConfigurationError(place, value, f'a list of {size}{kind}')
    parts = (numbers_of(part, shape[1:], f'{place}[{k}]') for k, part in enumerate(value))
    return tuple(itertools.chain.from_iterable(parts))


def parameter_infos(cls: type[object], prefix: str = '') -> dict[str, ParameterInfo]:
    """Return the `ParameterInfo` of every field of a configuration class, by dotted name."""
    infos: dict[str, ParameterInfo] = {}
    for field in dataclasses.fields(cast('Any', cls)):
        if _KEY in field.metadata:
            infos[prefix + field.name] = field.metadata[_KEY]
        elif dataclasses.is_dataclass(nested := field.default_factory):
            infos.update(parameter_infos(cast('type[object]', nested), f'{prefix}{field.name}.'))
    return infos


def flatten_config(config: object) -> dict[str, Any]:
    """Return the values of a configuration by dotted name, nested dataclasses opened."""
    return {name: attrgetter(name)(config) for name in parameter_infos(type(config))}


def build_config(cls: type[ConfigT], values: Mapping[str, Any], prefix: str = '') -> ConfigT:
    """Build a configuration from values by dotted name; what is missing keeps its default.

    Lists become tuples, whole numbers become floats where the default is a float. The prefix is
    that of the names that belong to the class.

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
    """Return a number as a float; all else as it is."""
    return float(value) if is_number(value) else value
