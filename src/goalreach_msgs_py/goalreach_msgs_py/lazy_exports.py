"""Packages that import each exported name on first use."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module


def lazy_exports(
    package: str, exports: Mapping[str, Sequence[str]]
) -> tuple[list[str], Callable[[str], object]]:
    """Return `__all__` and a `__getattr__` that imports each name when it is first used.

    Args:
        package: Name of the package.
        exports: Exported names by module of the package.
    """
    modules = {name: module for module, names in exports.items() for name in names}

    def get(name: str) -> object:
        if name not in modules:
            raise AttributeError(f'module {package!r} has no attribute {name!r}')
        return getattr(import_module(f'{package}.{modules[name]}'), name)

    return sorted(modules), get
