"""Draws the packages and their imports into ARCHITECTURE.md: `python3 test/support/drawing.py`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
import re

from architecture import ALLOWED, LAB, PACKAGES, Module, reachable

ROOT = Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / 'ARCHITECTURE.md'
_BLOCK = re.compile(r'```mermaid\n.*?```\n', re.DOTALL)


def all_modules() -> list[Module]:
    """Return every module in `src/` and `lab/`."""
    found = []
    for package in (*PACKAGES, LAB):
        base = ROOT / 'lab' if package == LAB else ROOT / 'src' / package
        for path in sorted(base.glob(f'{package}/**/*.py')):
            parts = path.relative_to(base).with_suffix('').parts
            name = '.'.join(parts[:-1] if parts[-1] == '__init__' else parts)
            found.append(Module(name=name, text=path.read_text()))
    return found


def package_imports(modules: Iterable[Module]) -> dict[str, set[str]]:
    """Return, for each package, which others its modules import."""
    found: dict[str, set[str]] = {package: set() for package in (*PACKAGES, LAB)}
    for module in modules:
        tops = {name.partition('.')[0] for name in module.imports()}
        found[module.package] |= (tops & set(ALLOWED)) - {module.package}
    return found


def draw(imports: Mapping[str, set[str]]) -> str:
    """Return a Mermaid drawing of the packages.

    An arrow means that a package imports another; those that follow from others are left out.
    """
    lines = ['```mermaid', 'flowchart BT']
    for package, targets in imports.items():
        lines.append(f'    {package}')
        indirect = {name for target in targets for name in reachable(target, imports)}
        lines += [f'    {package} --> {target}' for target in sorted(targets - indirect)]
    return '\n'.join([*lines, '```', ''])


def drawn() -> str:
    """Return the drawing that the document holds."""
    found = _BLOCK.search(DOCUMENT.read_text())
    return found[0] if found else ''


if __name__ == '__main__':
    text = DOCUMENT.read_text()
    DOCUMENT.write_text(_BLOCK.sub(draw(package_imports(all_modules())), text, count=1))
