"""Animations as files: GIF, written by Pillow."""

from __future__ import annotations

from pathlib import Path
import tempfile

from matplotlib import rc_context
from matplotlib.animation import PillowWriter

from goalreach_bringup.figures.path_animation import FRAMES_PER_S, Animation
from goalreach_msgs_py.atomic_file import make_folder, write_bytes_atomically

__all__ = ['write_animation']

_DPI = 80


def write_animation(animation: Animation, folder: Path, name: str) -> Path:
    """Write an animation as `NAME.gif`.

    Args:
        animation: What to write.
        folder: Where; made if it is not there.
        name: Name without ending.

    Returns:
        The file.

    Raises:
        FileFormatError: The file cannot be written.
    """
    make_folder(folder)
    path = folder / f'{name}.gif'
    with tempfile.TemporaryDirectory() as scratch, rc_context({'font.family': 'DejaVu Sans'}):
        drawn = Path(scratch) / path.name
        animation.frames.save(drawn, writer=PillowWriter(fps=FRAMES_PER_S), dpi=_DPI)
        write_bytes_atomically(path, drawn.read_bytes())
    return path
