"""Standard ROS 2 parameter files: `node: {ros__parameters: {name: value}}`."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from goalreach_msgs_py.errors import FileFormatError, one_line_repr
from goalreach_msgs_py.files import read_yaml, write_text_atomically
from goalreach_msgs_py.topics import NODES

NodeParameters = dict[str, dict[str, Any]]
"""Parameter values by dotted name, by node name."""

_KEY = 'ros__parameters'
_WILDCARDS = ('/**', '**', '/*')
_DEEPEST = 20


def read_parameters(path: str | Path | None, namespace: str = '') -> NodeParameters:
    """Return the parameters of a file for each node of the graph, wildcards applied first.

    Without a file there are none. Sections of other namespaces are for other robots.

    Raises:
        FileFormatError: The file cannot be read, is not a parameter file, or names another node.
    """
    parameters: NodeParameters = {node: {} for node in NODES}
    if path is None:
        return parameters
    sections = read_yaml(path)
    if not isinstance(sections, dict) or not sections:
        raise FileFormatError(path, f'must be a mapping of nodes to {_KEY}')
    for name in sorted(sections, key=lambda key: key not in _WILDCARDS):
        section = sections[name]
        if not isinstance(section, dict) or not isinstance(section.get(_KEY), dict):
            raise FileFormatError(path, f'{name}: must hold a mapping {_KEY}')
        values = _flatten(path, section[_KEY])
        if name in _WILDCARDS:
            for node_values in parameters.values():
                node_values.update(values)
            continue
        space, _, node = str(name).rpartition('/')
        if node not in parameters:
            raise FileFormatError(path, f'{name}: must be one of {", ".join(NODES)} or /**')
        if space.strip('/') in ('', '**', namespace):
            parameters[node].update(values)
    return parameters


def _flatten(path: str | Path, values: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    flat: dict[str, Any] = {}
    if prefix.count('.') > _DEEPEST:
        raise FileFormatError(path, f'{prefix[:60]}: is nested too deeply')
    for key, value in values.items():
        name = f'{prefix}{key}'
        if isinstance(value, dict):
            flat.update(_flatten(path, value, f'{name}.'))
        elif value is None:
            raise FileFormatError(path, f'{name}: has no value')
        elif isinstance(value, (bool, int, float, str, list)):
            flat[name] = value
        else:
            reason = f'{name} = {one_line_repr(value)}: must be a number, text or list'
            raise FileFormatError(path, reason)
    return flat


def merge_parameters(*layers: NodeParameters) -> NodeParameters:
    """Return the union of parameters; later layers win."""
    merged: NodeParameters = {}
    for layer in layers:
        for node, values in layer.items():
            merged.setdefault(node, {}).update(values)
    return merged


def write_parameters(
    path: str | Path, parameters: NodeParameters, namespace: str = '', comments: Iterable[str] = ()
) -> None:
    """Write a parameter file, with comments for people at its beginning.

    Empty lists are left out: they are the defaults, and the format does not record their type.

    Raises:
        FileFormatError: The file cannot be written.
    """
    document = {
        f'/{namespace}/{node}' if namespace else node: {
            _KEY: {
                name: [*map(float, value)] if isinstance(value, tuple) else value
                for name, value in values.items()
                if value not in ((), [])
            }
        }
        for node, values in parameters.items()
    }
    head = ''.join(f'# {line}\n' for line in comments)
    write_text_atomically(path, head + yaml.safe_dump(document, sort_keys=True))
