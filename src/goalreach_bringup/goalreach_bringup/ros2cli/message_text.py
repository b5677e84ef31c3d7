"""Messages as the text that `ros2 topic echo` prints: YAML, or comma-separated values."""

import array
from dataclasses import dataclass
import re
import sys
from typing import Any

import numpy as np
import yaml

_SEQUENCE = re.compile(r'sequence<(?P<of>.+?)(?:, (?P<bound>\d+))?>$')
_ARRAY = re.compile(r'(?P<of>.+)\[(?P<size>\d+)\]$')
_BOUNDED_STRING = re.compile(r'(w?string)<\d+>$')
_SEQUENCES = (list, tuple, array.array, np.ndarray)


@dataclass(frozen=True, kw_only=True)
class TextOptions:
    """Extent of the text of a message.

    Attributes:
        truncate_length: Elements of an array and characters of a string that are written before
            `...` stands for the others; None writes all.
        no_arr: Write the type and the length of an array in place of its elements.
        no_str: Write the length of a string in place of the string.
        flow_style: Write each list of YAML on one line, with brackets.
    """

    truncate_length: int | None = None
    no_arr: bool = False
    no_str: bool = False
    flow_style: bool = False


def message_to_yaml(message: object, options: TextOptions) -> str:
    r"""Return the message as YAML, with its fields in the order of their definition.

    Example:
        >>> from std_msgs.msg import Float64
        >>> message_to_yaml(Float64(data=1.5), TextOptions())
        'data: 1.5\n'
    """
    return values_to_yaml(message_values(message, options), options)


class _Dumper(yaml.Dumper):
    """Leaves the style of mappings open, as rosidl_runtime_py does: only lists are flowed."""

    def represent_mapping(self, tag: str, mapping: Any, flow_style: bool | None = None) -> Any:  # noqa: ANN401, ARG002, FBT001 - as the base class has it
        pairs = [(self.represent_data(k), self.represent_data(v)) for k, v in mapping.items()]
        return yaml.MappingNode(tag, pairs)


# Bytes become text, character by character, as ROS writes the type `byte`.
_Dumper.add_representer(bytes, lambda dumper, b: dumper.represent_str(b.decode('latin-1')))


def values_to_yaml(values: dict[str, object], options: TextOptions) -> str:
    """Return the values of a message as YAML, as `message_to_yaml` does."""
    text: str = yaml.dump(
        values,
        Dumper=_Dumper,
        allow_unicode=True,
        default_flow_style=options.flow_style,
        width=sys.maxsize,
    )
    return text


def message_to_csv(message: Any, options: TextOptions) -> str:  # noqa: ANN401 - no common base
    """Return the values of all fields, nested ones too, separated by commas."""
    return _csv(message_values(message, options))


def message_values(message: Any, options: TextOptions) -> dict[str, Any]:  # noqa: ANN401
    """Return the fields as dicts, lists, strings, bytes, numbers and booleans alone."""
    fields = message.get_fields_and_field_types()
    return {name: _plain(getattr(message, name), kind, options) for name, kind in fields.items()}


def _plain(value: Any, kind: str | None, options: TextOptions) -> object:  # noqa: ANN401
    """Return the value as `message_values` does.

    Args:
        value: A field of a message, or an element of one.
        kind: The ROS type of the field; None for an element.
        options: Options of the text.
    """
    length = sys.maxsize if options.truncate_length is None else options.truncate_length
    if isinstance(value, bytes):
        return value if len(value) <= length else value[:length] + b'...'
    if isinstance(value, str):
        cut = value if len(value) <= length else f'{value[:length]}...'
        return f'<string length: <{len(value)}>>' if options.no_str else cut
    if isinstance(value, _SEQUENCES):
        if options.no_arr and kind is not None:
            return _describe(kind, len(value))
        shown = value[:length]
        elements = shown.tolist() if hasattr(shown, 'tolist') else shown
        dots = ['...'] if len(shown) < len(value) else []
        return [*(_plain(element, None, options) for element in elements), *dots]
    return value if isinstance(value, (bool, int, float)) else message_values(value, options)


def _csv(value: object) -> str:
    """Return the text of a value, or those in it with commas between them.

    As in ros2cli, empty values at the beginning leave no commas.
    """
    if not isinstance(value, (dict, list)):
        return str(value)
    text = ''
    for element in value.values() if isinstance(value, dict) else value:
        text += f',{_csv(element)}' if text else _csv(element)
    return text


def _describe(kind: str, length: int) -> str:
    """Return what stands for an array, such as `<sequence type: double, length: 3>`."""
    if match := _ARRAY.match(kind):
        return f'<array type: {_element_name(match["of"])}[{match["size"]}]>'
    if match := _SEQUENCE.match(kind):
        bound = f'[{match["bound"]}]' if match['bound'] else ''
        return f'<sequence type: {_element_name(match["of"])}{bound}, length: {length}>'
    return 'unknown'


def _element_name(kind: str) -> str:
    """Return the full name of an element's type, such as `package/msg/Name`."""
    if match := _BOUNDED_STRING.match(kind):
        return match[1]
    return kind.replace('/', '/srv/' if kind.endswith(('_Request', '_Response')) else '/msg/')
