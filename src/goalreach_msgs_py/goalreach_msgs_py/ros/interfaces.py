"""Python classes of messages and services by the names of their types."""

import importlib
from typing import Any

from goalreach_msgs_py.errors import CommandError


def message_class(name: str) -> Any:
    """Return the class of a message, `package/msg/Name`, or `package/Name` for short.

    Raises:
        CommandError: There is no such message, or its package is not installed.
    """
    found = _find(name, 'msg')
    if not hasattr(found, 'get_fields_and_field_types'):
        raise CommandError(f"The passed message type is invalid: '{name}'")
    return found


def service_class(name: str) -> Any:
    """Return the class of a service, `package/srv/Name`, or `package/Name` for short.

    Raises:
        CommandError: There is no such service type, or its package is not installed.
    """
    found = _find(name, 'srv')
    if not hasattr(found, 'Request'):
        raise CommandError(f"The passed service type is invalid: '{name}'")
    return found


def full_type_name(name: str, kind: str) -> str:
    """Return `package/kind/Name`, of kind `msg` or `srv`, for `package/Name`; others unchanged."""
    return name.replace('/', f'/{kind}/') if name.count('/') == 1 else name


def _find(name: str, kind: str) -> Any:
    """Return the class, or None where there is none."""
    package, *names = full_type_name(name, kind).split('/')
    if len(names) != 2 or not all(map(str.isidentifier, (package, *names))):  # noqa: PLR2004
        return None
    try:
        module = importlib.import_module(f'{package}.{names[0]}')
    except ModuleNotFoundError:
        return None
    return getattr(module, names[1], None)
