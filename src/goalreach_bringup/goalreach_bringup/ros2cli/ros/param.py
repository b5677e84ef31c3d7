"""`ros2 param`: the parameters of the nodes."""

from __future__ import annotations

import argparse
import re
import sys
from typing import Any, Final

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rclpy.parameter import get_parameter_value, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
import yaml

from goalreach_bringup.ros2cli.ros.session import Session, add_session_arguments, full_name
from goalreach_msgs_py.errors import CommandError

_CALL_S: Final = 5.0
"""Longest wait for an answer, as in ros2cli."""

_TYPES: Final = {
    ParameterType.PARAMETER_NOT_SET: ('not set', 'Parameter not set.'),
    ParameterType.PARAMETER_BOOL: ('boolean', 'Boolean value is:'),
    ParameterType.PARAMETER_INTEGER: ('integer', 'Integer value is:'),
    ParameterType.PARAMETER_DOUBLE: ('double', 'Double value is:'),
    ParameterType.PARAMETER_STRING: ('string', 'String value is:'),
    ParameterType.PARAMETER_BYTE_ARRAY: ('byte array', 'Byte values are:'),
    ParameterType.PARAMETER_BOOL_ARRAY: ('boolean array', 'Boolean values are:'),
    ParameterType.PARAMETER_INTEGER_ARRAY: ('integer array', 'Integer values are:'),
    ParameterType.PARAMETER_DOUBLE_ARRAY: ('double array', 'Double values are:'),
    ParameterType.PARAMETER_STRING_ARRAY: ('string array', 'String values are:'),
}
"""Type code: name of the type, and the text before a value of it."""


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 param`."""
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    verb = verbs.add_parser('list', help='Output a list of available parameters')
    verb.add_argument('node_name', nargs='?', help='Name of the ROS node')
    verb.add_argument('--param-prefixes', nargs='+', default=[], help='Only these prefixes')
    verb.add_argument('--param-type', action='store_true', help='Print types with the names')
    verb.add_argument('--filter', metavar='REGEX', help='Only names that match the expression')
    verb.set_defaults(run=list_parameters)

    verb = verbs.add_parser('get', help='Get parameter')
    verb.add_argument('node_name', help='Name of the ROS node')
    verb.add_argument('parameter_name', help='Name of the parameter')
    verb.add_argument('--hide-type', action='store_true', help='Hide the type information')
    verb.set_defaults(run=get_parameter)

    verb = verbs.add_parser('set', help='Set parameter')
    verb.add_argument('node_name', help='Name of the ROS node')
    verb.add_argument('parameter_name', help='Name of the parameter')
    verb.add_argument('value', help='Value of the parameter, in YAML')
    verb.set_defaults(run=set_parameter)

    verb = verbs.add_parser('dump', help='Show all of the parameters of a node in a YAML format')
    verb.add_argument('node_name', help='Name of the ROS node')
    verb.set_defaults(run=dump_parameters)
    for verb in verbs.choices.values():
        add_session_arguments(verb)
        verb.add_argument(
            '--include-hidden-nodes', action='store_true', help='Consider hidden nodes as well'
        )


def list_parameters(args: argparse.Namespace) -> None:
    """Print the names of the parameters of one node, or of all that have any.

    Raises:
        CommandError: There is no such node, or it does not answer.
    """
    with Session(args) as session:
        if args.node_name:
            _print_names(session, _client(session, args), args)
            return
        session.discover()
        for name in session.node_names(hidden=args.include_hidden_nodes):
            if f'{name}/list_parameters' not in session.services():
                continue
            print(f'{name}:')
            try:
                _print_names(session, AsyncParameterClient(session.node, name), args)
            except CommandError as error:
                print(error, file=sys.stderr)


def get_parameter(args: argparse.Namespace) -> None:
    """Print the value of a parameter.

    Raises:
        CommandError: There is no such node or parameter, or it does not answer.
    """
    with Session(args) as session:
        client = _client(session, args)
        values = _answer(session, client.get_parameters([args.parameter_name])).values
    if not values or values[0].type == ParameterType.PARAMETER_NOT_SET:
        raise CommandError('Parameter not set.')
    value = parameter_value_to_python(values[0])
    print(value if args.hide_type else f'{_TYPES[values[0].type][1]} {value}')


def set_parameter(args: argparse.Namespace) -> None:
    """Set a parameter. Departure from ros2cli: a refusal ends with status 1.

    Raises:
        CommandError: There is no such node, or it refuses the value, with its reason.
    """
    parameter = Parameter(name=args.parameter_name, value=_parse(args.value))
    with Session(args) as session:
        client = _client(session, args)
        result = _answer(session, client.set_parameters([parameter])).results[0]
    reason = f': {result.reason}' if result.reason else ''
    if not result.successful:
        raise CommandError(f'Setting parameter failed{reason}')
    print(f'Set parameter successful{reason}')


def dump_parameters(args: argparse.Namespace) -> None:
    """Print the parameters of a node as a parameter file.

    Raises:
        CommandError: There is no such node, or it does not answer.
    """
    with Session(args) as session:
        client = _client(session, args)
        names = sorted(_answer(session, client.list_parameters()).result.names)
        values = _answer(session, client.get_parameters(names)).values
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=False):
        *groups, leaf = name.split('.')
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[leaf] = parameter_value_to_python(value)
    print(yaml.dump({full_name(args.node_name): {'ros__parameters': tree}}))


def _client(session: Session, args: argparse.Namespace) -> Any:
    """Return a client of the parameters of the node that the user named."""
    name = full_name(args.node_name)
    if not session.find(lambda: name in session.node_names(hidden=True)):
        raise CommandError('Node not found')
    client = AsyncParameterClient(session.node, name)
    if not session.spin_until(client.services_are_ready, _CALL_S):
        raise CommandError(
            f'Wait for service timed out waiting for parameter services for node {name}'
        )
    return client


def _print_names(session: Session, client: Any, args: argparse.Namespace) -> None:
    names = sorted(_answer(session, client.list_parameters(args.param_prefixes)).result.names)
    if args.filter is not None:
        names = [name for name in names if re.search(args.filter, name)]
    suffixes = [''] * len(names)
    if args.param_type:
        descriptors = _answer(session, client.describe_parameters(names)).descriptors
        suffixes = [f' (type: {_TYPES[d.type][0]})' for d in descriptors]
    for name, suffix in zip(names, suffixes, strict=True):
        print(f'  {name}{suffix}')


def _answer(session: Session, future: Any) -> Any:
    return session.result(future, _CALL_S, 'Exception while calling service of node')


def _parse(text: str) -> ParameterValue:
    """Return the value of the type that the text looks like; a string where it looks like none."""
    try:
        return get_parameter_value(text)
    except (AssertionError, yaml.YAMLError):  # a mapping, or not YAML
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=text)
