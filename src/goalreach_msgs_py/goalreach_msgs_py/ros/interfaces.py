"""Python classes of messages and services by the names of their types."""

from contextlib import suppress
import importlib
from typing import Any

from goalreach_msgs_py.errors import CommandError


def message_class(name: str) -> Any:
    """Return the class of a message, `package/msg/Name`, or `package/Name` for short.

    Raises:
        CommandError: There is no such message, or its package is not installed.
    """
    return _find(name, 'msg', 'message', 'get_fields_and_field_types')


def service_class(name: str) -> Any:
    """Return the class of a service, `package/srv/Name`, or `package/Name` for short.

    Raises:
        CommandError: There is no such service type, or its package is not installed.
    """
    return _find(name, 'srv', 'service', 'Request')


def full_type_name(name: str, kind: str) -> str:
    """Return `package/kind/Name`, of kind `msg` or `srv`, for `package/Name`; others unchanged."""
    return name.replace('/', f'/{kind}/') if name.count('/') == 1 else name


def _find(name: str, kind: str, word: str, attribute: str) -> Any:
    """Return the class, which has an attribute that only those of its kind have."""
    package, *names = full_type_name(name, kind).split('/')
    found = None
    if len(names) == 2 and all(map(str.isidentifier, (package, *names))):  # noqa: PLR2004
        with suppress(ModuleNotFoundError):
            found = getattr(importlib.import_module(f'{package}.{names[0]}'), names[1], None)
    if not hasattr(found, attribute):
        raise CommandError(f"The passed {word} type is invalid: '{name}'")
    return found
