"""Modules that are no part of a package."""

import importlib.util
from pathlib import Path
import sys
from types import ModuleType


def load_module(path: Path) -> ModuleType:
    """Return the module in a file, such as an example."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))  # as for a script
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(path.parent))
    return module
