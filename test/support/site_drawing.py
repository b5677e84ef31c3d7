"""The drawing of the packages as SVG, from the same imports as that of ARCHITECTURE.md."""

from architecture import LAB, LAYERS, reachable
from drawing import all_modules, package_imports

_WIDTH, _HEIGHT = 176, 30
_COLUMN, _ROW = 196, 74


def drawing_svg() -> str:
    """Return the packages in rows by layer, the lowest at the bottom, with arrows downwards."""
    rows = [*LAYERS[:-1], (*LAYERS[-1], LAB)]
    across = max(map(len, rows)) * _COLUMN
    centres = {}
    for height, row in enumerate(reversed(rows)):
        left = (across - len(row) * _COLUMN) / 2
        for column, package in enumerate(row):
            centres[package] = (left + (column + 0.5) * _COLUMN, height * _ROW + _HEIGHT / 2 + 4)
    imports = package_imports(all_modules())
    lines = []
    for package, targets in imports.items():
        indirect = {name for target in targets for name in reachable(target, imports)}
        lines += [_arrow(centres[package], centres[t]) for t in sorted(targets - indirect)]
    boxes = [_box(package, *centre) for package, centre in centres.items()]
    view = f'0 0 {across} {(len(rows) - 1) * _ROW + _HEIGHT + 8}'
    return (
        f'<svg class="packages" viewBox="{view}" role="img" aria-label="Packages and imports">'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" '
        'markerHeight="8" orient="auto"><path d="M0 0 8 4 0 8z"/></marker></defs>'
        f'{"".join(lines + boxes)}</svg>'
    )


def _arrow(start: tuple[float, float], end: tuple[float, float]) -> str:
    (x1, y1), (x2, y2) = start, end
    half = _HEIGHT / 2
    path = f'M{x1:g} {y1 + half:g} L{x2:g} {y2 - half - 2:g}'
    return f'<path class="arrow" marker-end="url(#tip)" d="{path}"/>'


def _box(package: str, x: float, y: float) -> str:
    left, top = x - _WIDTH / 2, y - _HEIGHT / 2
    return (
        f'<rect x="{left:g}" y="{top:g}" width="{_WIDTH}" height="{_HEIGHT}" rx="5"/>'
        f'<text x="{x:g}" y="{y + 5:g}">{package}</text>'
    )
