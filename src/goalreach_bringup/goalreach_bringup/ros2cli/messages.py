"""Messages as the YAML text that `ros2 topic echo` prints, and messages from values in YAML."""

import array
from collections.abc import Callable
from functools import partial
import re
import sys
from typing import Any, Final, TypeAlias

import numpy as np
import yaml

from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.files import load_yaml
from goalreach_msgs_py.ros.interfaces import message_class

Stamper: TypeAlias = Callable[[Any], None]
"""Sets a `builtin_interfaces/msg/Time` where the values say `now` or `auto`."""

_LIST: Final = re.compile(r'sequence<(?P<bounded>.+?)(?:, \d+)?>|(?P<fixed>.+)\[\d+\]')
_SCALARS: Final[dict[str, type]] = {
    'boolean': bool,
    'octet': bytes,
    **dict.fromkeys(('float', 'double'), float),
    **dict.fromkeys(('string', 'wstring'), str),
}
"""Python types of ROS types; of all others that are no messages, int."""
_SEQUENCES = (list, tuple, array.array, np.ndarray)


class _Dumper(yaml.SafeDumper):
    """Writes bytes as text, character by character, as ROS writes the type `byte`."""


_Dumper.add_representer(bytes, lambda dumper, b: dumper.represent_str(b.decode('latin-1')))


def message_to_yaml(message: object, most: int | None = None, *, arrays: bool = True) -> str:
    r"""Return the message as YAML, with its fields in the order of their definition.

    Args:
        message: The message.
        most: Elements of an array and characters of a string that are written before `...`
            stands for the others; None writes all.
        arrays: Whether to write the elements of arrays, or only of which type they are.

    Example:
        >>> from std_msgs.msg import Float64
        >>> message_to_yaml(Float64(data=1.5))
        'data: 1.5\n'
    """
    text: str = yaml.dump(
        _plain(message, sys.maxsize if most is None else most, arrays=arrays),
        Dumper=_Dumper,
        allow_unicode=True,
        default_flow_style=False,
        sort_keys=False,
        width=sys.maxsize,
    )
    return text


def _plain(value: Any, most: int, *, arrays: bool) -> object:
    """Return a value as dicts, lists, strings, bytes, numbers and booleans alone."""
    if isinstance(value, (bool, int, float, bytes)):  # bytes: one
        return value
    if isinstance(value, str):
        return value if len(value) <= most else f'{value[:most]}...'
    if isinstance(value, _SEQUENCES):
        shown = value[:most]
        elements = shown.tolist() if hasattr(shown, 'tolist') else shown
        dots = ['...'] if len(shown) < len(value) else []
        return [*(_plain(element, most, arrays=arrays) for element in elements), *dots]
    fields: dict[str, object] = {}
    for name, kind in value.get_fields_and_field_types().items():
        field = getattr(value, name)
        if isinstance(field, _SEQUENCES) and not arrays:
            fields[name] = _type_text(kind, len(field))
        else:
            fields[name] = _plain(field, most, arrays=arrays)
    return fields


def _type_text(kind: str, length: int) -> str:
    if kind.endswith(']'):
        return f'<array type: {kind}>'
    return f'<sequence type: {kind[len("sequence<") : -1]}, length: {length}>'


def parse_values(text: str) -> dict[str, Any]:
    """Return the YAML mapping in a text; an empty text is an empty mapping.

    Raises:
        CommandError: The text is not YAML, or not a mapping.
    """
    try:
        values = load_yaml(text)
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
    message, stampers = kind(check_fields=True), list[Stamper]()
    _fill(message, values, '', stampers)
    return message, stampers


def _fill(message: Any, values: Any, path: str, stampers: list[Stamper]) -> None:
    """Set the fields of the message that is found at the path, which ends with a dot."""
    if not isinstance(values, dict):
        raise _refuse(path.rstrip('.') or 'message', values, 'a dictionary')
    kinds = message.get_fields_and_field_types()
    for name, value in values.items():
        if name not in kinds:
            owner = type(message).__name__
            raise CommandError(
                f"Failed to populate field: '{owner}' object has no attribute '{path}{name}'"
            )
        converted = _convert(kinds[name], value, f'{path}{name}', stampers)
        try:
            setattr(message, name, converted)
        except (AssertionError, OverflowError, TypeError, ValueError) as error:
            reason = ' '.join(str(error).split())
            raise CommandError(f'Failed to populate field: {path}{name}: {reason}') from None


def _convert(kind: str, value: Any, path: str, stampers: list[Stamper]) -> Any:
    """Return the value as one of a ROS type; a field makes an array of a list itself."""
    if match := _LIST.fullmatch(kind):
        if not isinstance(value, list):
            raise _refuse(path, value, 'a list')
        element = match['bounded'] or match['fixed']
        return [_convert(element, v, f'{path}[{i}]', stampers) for i, v in enumerate(value)]
    if '/' not in kind:
        return _scalar(_SCALARS.get(kind.partition('<')[0], int), value, path)
    message = message_class(kind)(check_fields=True)
    if kind == 'std_msgs/Header' and value == 'auto':
        stampers.append(partial(_copy_time, message.stamp))
    elif kind == 'builtin_interfaces/Time' and value == 'now':
        stampers.append(partial(_copy_time, message))
    else:
        _fill(message, value, f'{path}.', stampers)
    return message


def _copy_time(target: Any, now: Any) -> None:
    target.sec, target.nanosec = now.sec, now.nanosec


def _scalar(kind: type, value: Any, path: str) -> Any:
    """Return the value as a bool, int, float, str or one byte, if nothing is lost."""
    refusal = _refuse(path, value, f'of type {kind.__name__}')
    if value is None or isinstance(value, (dict, list)) or (kind is bool and value not in (0, 1)):
        raise refusal
    try:
        if kind is bytes:
            converted = bytes([value]) if isinstance(value, int) else value.encode('latin-1')
        else:
            converted = kind(value)
    except (AttributeError, OverflowError, TypeError, ValueError):
        raise refusal from None
    cut = kind is int and isinstance(value, float) and converted != value
    if cut or (kind is bytes and len(converted) != 1):
        raise refusal
    return converted


def _refuse(path: str, value: object, wanted: str) -> CommandError:
    return CommandError(f'Failed to populate field: {path} = {value!r}: must be {wanted}')
