"""Python classes of messages and services by the names of their types."""

import importlib
from typing import Any

from goalreach_msgs_py.errors import CommandError


def message_class(name: str) -> Any:
    """Return the class of a message.

    Args:
        name: `package/msg/Name`, or `package/Name` for short.

    Raises:
        CommandError: There is no such message, or its package is not installed.
    """
    found = _find(name, 'msg')
    if not hasattr(found, 'get_fields_and_field_types'):
        raise CommandError(f"The passed message type is invalid: '{name}'")
    return found


def service_class(name: str) -> Any:
    """Return the class of a service, with its attributes `Request` and `Response`.

    Args:
        name: `package/srv/Name`, or `package/Name` for short.

    Raises:
        CommandError: There is no such service type, or its package is not installed.
    """
    found = _find(name, 'srv')
    if found is None:
        raise CommandError(f"The passed service type is invalid: '{name}'")
    if not (hasattr(found, 'Request') and hasattr(found, 'Response')):
        raise CommandError(f"The passed type is not a service: '{name}'")
    return found


def interface_class(name: str) -> Any:
    """Return the class of a message, service or action by its full name, `package/kind/Name`.

    Raises:
        CommandError: There is no such type, or its package is not installed.
    """
    found = _find(name, '') if name.count('/') > 1 else None
    if found is None:
        raise CommandError(f"The passed type is invalid: '{name}'")
    return found


def full_type_name(name: str, kind: str) -> str:
    """Return `package/kind/Name` for `package/Name`, and any other name unchanged.

    Args:
        name: The type's name.
        kind: `msg` or `srv`.
    """
    return name.replace('/', f'/{kind}/') if name.count('/') == 1 else name


def _find(name: str, kind: str) -> Any:
    """Return the class, or None where there is none."""
    parts = full_type_name(name, kind).split('/')
    if len(parts) != 3 or not all(part.isidentifier() for part in parts):  # noqa: PLR2004
        return None
    package, namespace, interface = parts
    try:
        module = importlib.import_module(f'{package}.{namespace}')
    except ModuleNotFoundError:
        return None
    return getattr(module, interface, None)
