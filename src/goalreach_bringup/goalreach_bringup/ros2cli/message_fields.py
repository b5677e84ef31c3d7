"""Messages from values in YAML."""

import array
from collections.abc import Callable
import re
from typing import Any, TypeAlias

import numpy as np
import yaml

from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import message_class

Stamper: TypeAlias = Callable[[Any], None]
"""Sets a `builtin_interfaces/msg/Time` where the values say `now` or `auto`."""

_ELEMENT = re.compile(r'(?:sequence<)?(?P<of>[\w/]+)')
_SEQUENCES = (list, tuple)


def parse_values(text: str) -> dict[str, Any]:
    """Return the YAML mapping in a text; an empty text is an empty mapping.

    Raises:
        CommandError: The text is not YAML, or not a mapping.
    """
    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        reason = ' '.join(str(error).split())
        raise CommandError(f'The passed value is not YAML: {reason}') from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise CommandError('The passed value needs to be a dictionary in YAML format')
    return values


def build_message(kind: Any, values: Any) -> tuple[Any, list[Stamper]]:
    """Return a message with the named fields set; the others keep their defaults.

    Numbers, strings and booleans are converted where nothing is lost (1 to 1.0, '1e-3' to
    0.001). Departure from ros2cli, which cuts 1.7 to 1 and takes any text for true: what does
    not fit is refused.

    Args:
        kind: The class of the message, or of the request of a service.
        values: Mapping from field names to values, nested like the message. A header may be
            `auto` and a time `now`.

    Returns:
        The message, and functions to be called with the present time before each publication.

    Raises:
        CommandError: A field that does not exist, or a value that does not fit, by its path.
    """
    message = kind(check_fields=True)
    return message, _fill(message, values, '')


def _fill(message: Any, values: Any, path: str) -> list[Stamper]:
    """Set the fields of the message that is found at the path, which ends with a dot."""
    if not isinstance(values, dict):
        raise _refuse(path.rstrip('.') or 'message', values, 'a dictionary')
    kinds = message.get_fields_and_field_types()
    stampers: list[Stamper] = []
    for name, value in values.items():
        if name not in kinds:
            owner = type(message).__name__
            raise CommandError(
                f"Failed to populate field: '{owner}' object has no attribute '{path}{name}'"
            )
        converted = _convert(getattr(message, name), value, kinds[name], f'{path}{name}', stampers)
        try:
            setattr(message, name, converted)
        except (AssertionError, OverflowError, TypeError, ValueError) as error:
            reason = ' '.join(str(error).split())
            raise CommandError(f'Failed to populate field: {path}{name}: {reason}') from None
    return stampers


def _convert(current: Any, value: Any, kind: str, path: str, stampers: list[Stamper]) -> Any:
    """Return the value as the type that the field holds now."""
    if hasattr(current, 'get_fields_and_field_types'):
        return _convert_message(type(current), value, kind, path, stampers)
    if not isinstance(current, (array.array, np.ndarray, *_SEQUENCES)):
        return _scalar(type(current), value, path)
    if not isinstance(value, _SEQUENCES):
        raise _refuse(path, value, 'a list')
    where = [f'{path}[{i}]' for i in range(len(value))]
    if isinstance(current, (array.array, np.ndarray)):
        code = current.typecode if isinstance(current, array.array) else current.dtype.char
        element = float if code in 'fd' else int
        numbers = [_scalar(element, v, w) for v, w in zip(value, where, strict=True)]
        try:
            if isinstance(current, np.ndarray):
                return np.array(numbers, dtype=code)
            return array.array(code, numbers)
        except OverflowError as error:
            raise CommandError(f'Failed to populate field: {path}: {error}') from None
    return [_element(kind, v, w, stampers) for v, w in zip(value, where, strict=True)]


def _convert_message(
    message_type: Any, value: Any, kind: str, path: str, stampers: list[Stamper]
) -> Any:
    message = message_type(check_fields=True)
    if kind == 'std_msgs/Header' and value == 'auto':
        stampers.append(lambda now: setattr(message, 'stamp', now))
    elif kind == 'builtin_interfaces/Time' and value == 'now':
        stampers.append(lambda now: _copy_time(message, now))
    else:
        stampers.extend(_fill(message, value, f'{path}.'))
    return message


def _copy_time(target: Any, now: Any) -> None:
    target.sec, target.nanosec = now.sec, now.nanosec


def _element(kind: str, value: Any, path: str, stampers: list[Stamper]) -> Any:
    """Return one element of a list of messages, strings, booleans or bytes."""
    match = _ELEMENT.match(kind)
    name = match['of'] if match else kind
    if '/' in name:
        return _convert_message(message_class(name), value, name, path, stampers)
    return _scalar({'boolean': bool, 'octet': bytes}.get(name, str), value, path)


def _scalar(kind: type, value: Any, path: str) -> Any:
    """Return the value as a bool, int, float, str or one byte, if nothing is lost."""
    if value is None or isinstance(value, (dict, *_SEQUENCES)):
        raise _refuse(path, value, f'of type {kind.__name__}')
    if kind is bytes and isinstance(value, int):
        value = chr(value) if 0 <= value <= 0xFF else ''  # noqa: PLR2004 - one byte
    if kind is bytes and isinstance(value, str):
        value = value.encode('latin-1', errors='ignore')
    if (kind is bool and value not in (0, 1)) or (kind is bytes and len(value) != 1):
        raise _refuse(path, value, f'of type {kind.__name__}')
    try:
        converted = kind(value)
    except (OverflowError, TypeError, ValueError):
        raise _refuse(path, value, f'of type {kind.__name__}') from None
    if kind is int and isinstance(value, float) and converted != value:
        raise _refuse(path, value, 'of type int')
    return converted


def _refuse(path: str, value: object, wanted: str) -> CommandError:
    return CommandError(f'Failed to populate field: {path} = {value!r}: must be {wanted}')
