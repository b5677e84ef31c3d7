"""Python classes of messages and services by the names of their types."""

from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
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
    """Return the class. Names come from bags and from others: no other module may be imported."""
    package, *names = full_type_name(name, kind).split('/')
    found = None
    if names[:-1] == [kind] and all(map(str.isidentifier, (package, names[-1]))):
        with suppress(ModuleNotFoundError, ValueError):  # the latter of a module without a spec
            folders = getattr(find_spec(package), 'submodule_search_locations', None) or ()
            if any(Path(folder, kind).is_dir() for folder in folders):
                found = getattr(import_module(f'{package}.{kind}'), names[-1], None)
    if not hasattr(found, attribute):
        raise CommandError(f"The passed {word} type is invalid: '{name}'")
    return found
