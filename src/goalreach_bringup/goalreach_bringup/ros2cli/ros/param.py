"""`ros2 param`: the parameters of the nodes."""

from __future__ import annotations

import argparse
import re
import sys
from typing import Any, Final

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rclpy.parameter import (
    get_parameter_value,
    parameter_dict_from_yaml_file,
    parameter_value_to_python,
)
from rclpy.parameter_client import AsyncParameterClient
import yaml

from goalreach_bringup.ros2cli.arguments import add_flags, non_negative_int
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


_VERBS: Final[dict[str, tuple[str, tuple[str, ...]]]] = {
    'list': ('Output a list of available parameters', ()),
    'get': ('Get parameter', ('parameter_name',)),
    'set': ('Set parameter', ('parameter_name', 'value')),
    'delete': ('Delete parameter', ('parameter_name',)),
    'describe': ('Show descriptive information about declared parameters', ('parameter_names',)),
    'dump': ('Show all of the parameters of a node in a YAML format', ()),
    'load': ('Load parameter file for a node', ('parameter_file',)),
}
"""Verb: its help, and its arguments after the name of the node."""

_ARGUMENTS: Final = {
    'parameter_name': 'Name of the parameter',
    'parameter_names': 'Names of the parameters',
    'parameter_file': 'Parameter file',
    'value': 'Value of the parameter, in YAML',
}


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 param`."""
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    for name, (text, arguments) in _VERBS.items():
        verb = verbs.add_parser(name, help=text)
        add_session_arguments(verb)
        add_flags(verb, ('--include-hidden-nodes', 'Consider hidden nodes as well'))
        verb.add_argument(
            '--timeout',
            metavar='N',
            type=non_negative_int,
            help='Wait for N seconds until node becomes available (default: --spin-time)',
        )
        verb.add_argument(
            'node_name', nargs='?' if name == 'list' else None, help='Name of the ROS node'
        )
        for argument in arguments:
            nargs = '+' if argument == 'parameter_names' else None
            verb.add_argument(argument, nargs=nargs, help=_ARGUMENTS[argument])
        verb.set_defaults(run=_RUN[name])
    verb = verbs.choices['list']
    verb.add_argument('--param-prefixes', nargs='+', default=[], help='Only these prefixes')
    add_flags(verb, ('--param-type', 'Print types with the names'))
    verb.add_argument('--filter', metavar='REGEX', help='Only names that match the expression')
    add_flags(verbs.choices['get'], ('--hide-type', 'Hide the type information'))
    text = "Do not load parameters in the '/**' namespace into the node"
    add_flags(verbs.choices['load'], ('--no-use-wildcard', text))


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
    _report(result, 'Set parameter successful', 'Setting parameter failed')


def delete_parameter(args: argparse.Namespace) -> None:
    """Delete a parameter. Departure from ros2cli: a refusal ends with status 1.

    Raises:
        CommandError: There is no such node, or it refuses, with its reason.
    """
    with Session(args) as session:
        client = _client(session, args)
        result = _answer(session, client.delete_parameters([args.parameter_name])).results[0]
    _report(result, 'Deleted parameter successfully', 'Deleting parameter failed')


def describe_parameters(args: argparse.Namespace) -> None:
    """Print type, description and constraints of parameters.

    Raises:
        CommandError: There is no such node, or it does not answer.
    """
    with Session(args) as session:
        client = _client(session, args)
        found = _answer(session, client.describe_parameters(args.parameter_names)).descriptors
    for one in found:
        lines = [f'Parameter name: {one.name}', f'  Type: {_TYPES[one.type][0]}']
        lines += [f'  Description: {one.description}'] if one.description else []
        lines += ['  Constraints:', *(['    Read only: true'] if one.read_only else [])]
        for limits in [*one.floating_point_range, *one.integer_range][:1]:
            lines += [f'    Min value: {limits.from_value}', f'    Max value: {limits.to_value}']
            lines += [f'    Step: {limits.step}'] if limits.step else []
        text = one.additional_constraints
        print('\n'.join([*lines, *([f'    Additional constraints: {text}'] if text else [])]))


def load_parameters(args: argparse.Namespace) -> None:
    """Set the parameters in a file. Departure from ros2cli: a refusal ends with status 1.

    Raises:
        CommandError: The file is not a parameter file, there is no such node, or it refuses.
    """
    name = full_name(args.node_name)
    try:
        parameters = list(
            parameter_dict_from_yaml_file(
                args.parameter_file, not args.no_use_wildcard, target_nodes=[name]
            ).values()
        )
    except (OSError, RuntimeError, yaml.YAMLError, AttributeError, TypeError, ValueError) as error:
        reason = ' '.join(str(error).split())
        raise CommandError(f'{args.parameter_file}: {reason}') from None
    with Session(args) as session:
        client = _client(session, args)
        results = _answer(session, client.set_parameters(parameters)).results
    lines = [
        (result.successful, _outcome(result, f'Set parameter {one.name} {word}'))
        for one, result in zip(parameters, results, strict=True)
        for word in ['successful' if result.successful else 'failed']
    ]
    for successful, line in lines:
        if successful:
            print(line)
    if failed := [line for successful, line in lines if not successful]:
        raise CommandError('\n'.join(failed))


def _outcome(result: Any, text: str) -> str:
    return f'{text}: {result.reason}' if result.reason else text


def _report(result: Any, success: str, failure: str) -> None:
    """Print the result of a change.

    Raises:
        CommandError: The change was refused.
    """
    if not result.successful:
        raise CommandError(_outcome(result, failure))
    print(_outcome(result, success))


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
    if not session.find(lambda: name in session.node_names(hidden=True), args.timeout):
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


_RUN: Final = {
    'list': list_parameters,
    'get': get_parameter,
    'set': set_parameter,
    'delete': delete_parameter,
    'describe': describe_parameters,
    'dump': dump_parameters,
    'load': load_parameters,
}
