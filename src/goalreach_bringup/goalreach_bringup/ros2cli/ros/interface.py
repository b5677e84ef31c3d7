"""`ros2 interface`: the types of messages, services and actions that are installed."""

import argparse
from collections.abc import Iterator
import os
from pathlib import Path
import sys
from typing import Any, Final

from rosidl_adapter.parser import InvalidSpecification, parse_message_string

from goalreach_bringup.ros2cli.arguments import add
from goalreach_bringup.ros2cli.message_text import TextOptions, message_to_yaml
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import interface_class

_INDEX: Final = 'share/ament_index/resource_index/rosidl_interfaces'
_KINDS: Final = {'msg': 'Messages', 'srv': 'Services', 'action': 'Actions'}
_SEPARATOR: Final = '---'
_PARTS: Final = 3


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 interface`."""
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    for name, text, run in (
        ('list', 'List all interface types available', print_names),
        ('package', 'Output a list of available types within one package', print_names),
        ('packages', 'Output a list of packages that provide interfaces', print_names),
        ('proto', 'Output an interface prototype', print_prototype),
        ('show', 'Output the interface definition; - reads its type from stdin', show_interface),
    ):
        verb = verbs.add_parser(name, help=text, description=text)
        verb.set_defaults(run=run, verb=name)
        if name in ('proto', 'show'):
            add(verb, ('type', "Name of the type (e.g. 'std_msgs/msg/String')"))
            continue
        for kind, title in _KINDS.items():
            add(verb, (f'-{kind[0]} --only-{kind}s', f'Print only the {title.lower()}'))
    add(verbs.choices['package'], ('package_name', 'Name of the ROS package'))
    add(verbs.choices['proto'], ('--no-quotes', 'Output no outer quotes'))
    add(
        verbs.choices['show'].add_mutually_exclusive_group(),
        ('--all-comments', 'Show all comments, those of nested definitions too'),
        ('--no-comments', 'Show no comments or whitespace'),
    )


def _prefixes() -> list[Path]:
    paths = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    return [Path(path) for path in [*paths, sys.prefix] if path]


def _interfaces() -> dict[str, list[str]]:
    """Return the interfaces, such as `msg/String`, of each installed package."""
    found: dict[str, list[str]] = {}
    for prefix in reversed(_prefixes()):
        for file in (prefix / _INDEX).glob('*'):
            names = file.read_text(encoding='utf-8').split()
            found[file.name] = sorted({n.rpartition('.')[0] for n in names if '_' not in n})
    return dict(sorted(found.items()))


def print_names(args: argparse.Namespace) -> None:
    """Print the names of all types kind by kind, of those of a package, or of all packages.

    Raises:
        CommandError: There is no such package.
    """
    kinds = [kind for kind in _KINDS if getattr(args, f'only_{kind}s')] or list(_KINDS)
    found = {
        package: [name for name in names if name.partition('/')[0] in kinds]
        for package, names in _interfaces().items()
    }
    if args.verb == 'packages':
        lines = [package for package, names in found.items() if names]
    elif args.verb == 'package':
        if args.package_name not in found:
            raise CommandError(f"Unknown package '{args.package_name}'")
        lines = [f'{args.package_name}/{name}' for name in found[args.package_name]]
    else:
        lines = []
        for kind in kinds:
            lines.append(f'{_KINDS[kind]}:')
            all_names = (f'{package}/{name}' for package in found for name in found[package])
            lines += [f'    {name}' for name in all_names if f'/{kind}/' in name]
    print(''.join(f'{line}\n' for line in lines), end='')


def print_prototype(args: argparse.Namespace) -> None:
    """Print a message, request or goal with its default values.

    Raises:
        CommandError: There is no such type.
    """
    kind = interface_class(args.type)
    kind = getattr(kind, 'Goal', getattr(kind, 'Request', kind))
    text = message_to_yaml(kind(), TextOptions())
    print(text if args.no_quotes else f'"{text}"')


def show_interface(args: argparse.Namespace) -> None:
    """Print the definition of a type, with those of the types in it.

    Raises:
        CommandError: There is no such type.
    """
    name = sys.stdin.readline().strip() if args.type == '-' else args.type
    for line in _lines(name, comments=not args.no_comments, nested=args.all_comments):
        print(line)


def _lines(name: str, *, comments: bool, nested: bool) -> Iterator[str]:
    """Yield the lines of a definition.

    Args:
        name: `package/kind/Name`.
        comments: Whether to keep its comments and empty lines.
        nested: Whether to keep those of the types in it.
    """
    for text in _read(name).splitlines():
        line = text.rstrip()
        spec = _parse(name, line)
        field = spec.fields[0] if spec is not None and spec.fields else None
        remark = field.annotations.get('comment') if field else None
        if comments:
            yield line
        elif line and not (spec is not None and spec.annotations['comment']):
            yield line[: line.find(remark[0]) - 1].strip() if remark else line
        if field is not None and not field.type.is_primitive_type():
            inner = f'{field.type.pkg_name}/msg/{field.type.type}'
            for found in _lines(inner, comments=nested, nested=nested):
                yield f'\t{found}'


def _parse(name: str, line: str) -> Any:
    """Return the specification of one line as rosidl reads it, None for a separator."""
    if line == _SEPARATOR:
        return None
    package, _, base = name.split('/')
    try:
        return parse_message_string(package, base, line)
    except InvalidSpecification as error:
        raise CommandError(f'{name}: {error}') from None


def _read(name: str) -> str:
    parts = name.split('/')
    if len(parts) != _PARTS:
        raise CommandError(f"Invalid name '{name}'. Expected three parts separated by '/'")
    for prefix in _prefixes():
        path = prefix / 'share' / f'{name}.{parts[1]}'
        if path.is_file():
            return path.read_text(encoding='utf-8')
    if parts[0] not in _interfaces():
        raise CommandError(f"Unknown package '{parts[0]}'")
    raise CommandError(f"Could not find the interface '{name}'")
