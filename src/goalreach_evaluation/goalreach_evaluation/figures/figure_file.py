"""Figures as files; the same data gives the same bytes."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from goalreach_msgs_py.files import make_folder, write_bytes_atomically

_PNG_DPI = 160
_METADATA: Any = {'svg': {'Date': None}, 'png': {'Software': None}}
_SETTINGS: Any = {'svg.hashsalt': 'goalreach', 'font.family': 'DejaVu Sans'}


def write_figure(
    figure: Figure, folder: Path, name: str, endings: Sequence[str] = ('svg', 'png')
) -> tuple[Path, ...]:
    """Write a figure as `NAME.svg`, `NAME.png` or both into a folder, made if it does not exist.

    Raises:
        FileFormatError: A file cannot be written.
    """
    make_folder(folder)
    files = []
    for ending in endings:
        content = BytesIO()
        with rc_context(_SETTINGS):
            figure.savefig(content, format=ending, dpi=_PNG_DPI, metadata=_METADATA[ending])
        files.append(folder / f'{name}.{ending}')
        write_bytes_atomically(files[-1], content.getvalue())
    return tuple(files)
