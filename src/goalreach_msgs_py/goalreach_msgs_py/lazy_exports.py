"""Packages that import each exported name on first use."""

import ast
from collections.abc import Callable
from importlib import import_module
import inspect


def lazy_exports(
    package: str,
) -> tuple[list[str], Callable[[str], object], Callable[[], list[str]]]:
    """Return `__all__`, a `__getattr__` that imports each name on first use, and `__dir__`.

    The names are those that the package's `__init__.py` imports under `if TYPE_CHECKING:`, so
    type checkers and the interpreter read the same list.

    Args:
        package: Name of the package.
    """
    source = ast.parse(inspect.getsource(import_module(package)))
    modules = {
        name.name: str(node.module)
        for block in source.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for name in node.names
    }

    def get(name: str) -> object:
        if name not in modules:
            raise AttributeError(f'module {package!r} has no attribute {name!r}')
        return getattr(import_module(modules[name]), name)

    return sorted(modules), get, lambda: sorted(modules)
