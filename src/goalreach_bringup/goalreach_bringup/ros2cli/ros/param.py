"""`ros2 param`: the parameters of the nodes."""

import argparse
from collections.abc import Callable
import sys
from typing import Any, Final

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rclpy.parameter import get_parameter_value, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.serialization import serialize_message
import yaml

from goalreach_bringup.ros2cli.ros.session import Session, full_name
from goalreach_msgs_py.errors import CommandError

_CALL_S: Final = 5.0
"""Longest wait for an answer, as in ros2cli."""

_TYPES: Final = (
    *('not set', 'boolean', 'integer', 'double', 'string'),
    *('byte array', 'boolean array', 'integer array', 'double array', 'string array'),
)
"""Names of the types by their codes (rcl_interfaces/ParameterType)."""


def list_parameters(args: argparse.Namespace) -> None:
    """Print the names of the parameters of one node, or of all that have any."""
    with Session(args) as session:
        if args.node_name:
            _print_names(session, _client(session, args))
            return
        session.discover()
        for name in session.node_names(hidden=args.hidden):
            if f'{name}/list_parameters' not in session.services():
                continue
            print(f'{name}:')
            try:
                _print_names(session, AsyncParameterClient(session.node, name))
            except CommandError as error:
                print(error, file=sys.stderr)


def _print_names(session: Session, client: Any) -> None:
    for name in sorted(session.result(client.list_parameters(), _CALL_S).result.names):
        print(f'  {name}')


def get_parameter(args: argparse.Namespace) -> None:
    """Print the value of a parameter."""
    values = _ask(args, lambda client: client.get_parameters([args.parameter_name])).values
    if not values or values[0].type == ParameterType.PARAMETER_NOT_SET:
        raise CommandError('Parameter not set.')
    value = parameter_value_to_python(values[0])
    kind, _, array = _TYPES[values[0].type].partition(' ')
    words = f'{kind.capitalize()} values are: ' if array else f'{kind.capitalize()} value is: '
    print(value if args.hide_type else f'{words}{value}')


def set_parameter(args: argparse.Namespace) -> None:
    """Set a parameter. Departure from ros2cli: a refusal ends with status 1."""
    parameter = Parameter(name=args.parameter_name, value=_parse(args.value))
    result = _ask(args, lambda client: client.set_parameters([parameter])).results[0]
    reason = f': {result.reason}' if result.reason else ''
    if not result.successful:
        raise CommandError(f'Setting parameter failed{reason}')
    print(f'Set parameter successful{reason}')


def dump_parameters(args: argparse.Namespace) -> None:
    """Print the parameters of a node as a parameter file."""
    with Session(args) as session:
        client = _client(session, args)
        names = sorted(session.result(client.list_parameters(), _CALL_S).result.names)
        values = session.result(client.get_parameters(names), _CALL_S).values
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=False):
        branch, leaf = tree, name
        if name.partition('.')[0] not in names:  # a parameter may be called like a group
            *groups, leaf = name.split('.')
            for group in groups:
                branch = branch.setdefault(group, {})
        branch[leaf] = parameter_value_to_python(value)
    print(yaml.dump({full_name(args.node_name): {'ros__parameters': tree}}))


def _ask(args: argparse.Namespace, call: Callable[[AsyncParameterClient], Any]) -> Any:
    """Return what the node that the user named answers to a call."""
    with Session(args) as session:
        return session.result(call(_client(session, args)), _CALL_S)


def _client(session: Session, args: argparse.Namespace) -> Any:
    """Return a client of the parameters of the node that the user named."""
    name = full_name(args.node_name)
    client = AsyncParameterClient(session.node, name)
    if not session.spin_until(client.services_are_ready, session.spin_time_s):
        waited = f'Wait for service timed out waiting for parameter services for node {name}'
        known = name in session.node_names(hidden=True)
        raise CommandError(waited if known else 'Node not found')
    return client


def _parse(text: str) -> ParameterValue:
    """Return the value of the type that the text looks like; a string where no type holds it."""
    try:
        value = get_parameter_value(text)
        serialize_message(value)
    except (AssertionError, OverflowError, SystemError, TypeError, ValueError, yaml.YAMLError):
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=text)
    return value
