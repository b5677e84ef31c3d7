"""`ros2 param`: the parameters of the nodes."""

import argparse
from collections.abc import Callable
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

from goalreach_bringup.ros2cli.arguments import COUNT, regular_expression
from goalreach_bringup.ros2cli.ros.session import Session, add_verb, full_name
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

_NAME: Final = ('parameter_name', 'Name of the parameter')


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 param`."""
    names = ('parameter_names', 'Names of the parameters', {'nargs': '+'})
    prefixes = ('--param-prefixes', 'Only these prefixes', {'nargs': '+', 'default': []})
    types = ('--param-type', 'Print types with the names')
    expression = {'metavar': 'REGEX', 'type': regular_expression}
    matching = ('--filter', 'Only names that match the expression', expression)
    value = ('value', 'Value of the parameter, in YAML')
    hide = ('--hide-type', 'Hide the type information')
    file = ('parameter_file', 'Parameter file')
    wildcard = ('--no-use-wildcard', "Do not load what the file has for '/**'")
    hidden = ('--include-hidden-nodes', 'Consider hidden nodes as well')
    timeout = ('--timeout', 'Wait for N seconds for the node (default: --spin-time)', COUNT)
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    for name, text, run, rows in (
        ('list', 'List parameters', list_parameters, (prefixes, types, matching)),
        ('get', 'Get parameter', get_parameter, (_NAME, hide)),
        ('set', 'Set parameter', change_parameter, (_NAME, value)),
        ('delete', 'Delete parameter', change_parameter, (_NAME,)),
        ('describe', 'Show information about parameters', describe_parameters, (names,)),
        ('dump', 'Show the parameters of a node in YAML', dump_parameters, ()),
        ('load', 'Load parameter file for a node', load_parameters, (file, wildcard)),
    ):
        node = ('node_name', 'Name of the ROS node', {'nargs': '?'} if name == 'list' else {})
        add_verb(verbs, name, text, run, node, hidden, timeout, *rows)


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
    values = _ask(args, lambda client: client.get_parameters([args.parameter_name])).values
    if not values or values[0].type == ParameterType.PARAMETER_NOT_SET:
        raise CommandError('Parameter not set.')
    value = parameter_value_to_python(values[0])
    print(value if args.hide_type else f'{_TYPES[values[0].type][1]} {value}')


def change_parameter(args: argparse.Namespace) -> None:
    """Set or delete a parameter. Departure from ros2cli: a refusal ends with status 1.

    Raises:
        CommandError: There is no such node, or it refuses the change, with its reason.
    """
    setting = hasattr(args, 'value')
    value = _parse(args.value) if setting else ParameterValue()
    parameter = Parameter(name=args.parameter_name, value=value)
    result = _ask(args, lambda client: client.set_parameters([parameter])).results[0]
    if result.successful:
        done = 'Set parameter successful' if setting else 'Deleted parameter successfully'
        print(_with_reason(done, result))
    else:
        failed = 'Setting' if setting else 'Deleting'
        raise CommandError(_with_reason(f'{failed} parameter failed', result))


def _with_reason(text: str, result: Any) -> str:
    return f'{text}: {result.reason}' if result.reason else text


def describe_parameters(args: argparse.Namespace) -> None:
    """Print type, description and constraints of parameters.

    Raises:
        CommandError: There is no such node, or it does not answer.
    """
    found = _ask(args, lambda client: client.describe_parameters(args.parameter_names)).descriptors
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
    results = _ask(args, lambda client: client.set_parameters(parameters)).results
    failed = []
    for parameter, result in zip(parameters, results, strict=True):
        if result.successful:
            print(_with_reason(f'Set parameter {parameter.name} successful', result))
        else:
            failed.append(_with_reason(f'Set parameter {parameter.name} failed', result))
    if failed:
        raise CommandError('\n'.join(failed))


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


def _ask(args: argparse.Namespace, call: Callable[[AsyncParameterClient], Any]) -> Any:
    """Return what the node that the user named answers to a call."""
    with Session(args) as session:
        return _answer(session, call(_client(session, args)))


def _client(session: Session, args: argparse.Namespace) -> Any:
    """Return a client of the parameters of the node that the user named."""
    name = full_name(args.node_name)
    limit_s = session.spin_time_s if args.timeout is None else args.timeout
    if not session.spin_until(lambda: name in session.node_names(hidden=True), limit_s):
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
        names = [name for name in names if args.filter.search(name)]
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
