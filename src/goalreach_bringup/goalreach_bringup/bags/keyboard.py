"""Single keys from the terminal, while a command goes on with its work."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
import select
import sys
import termios
import tty
from typing import Final

__all__ = ['Keyboard']

_LONGEST_KEY: Final = 8


class Keyboard:
    """Reads keys as they are pressed; knows none where stdin is no terminal."""

    def __init__(self) -> None:
        self.is_there = sys.stdin.isatty()

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Take keys unechoed and at once while the context lasts."""
        if not self.is_there:
            yield
            return
        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)
        try:
            tty.setcbreak(descriptor)
            yield
        finally:
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)

    def key(self, timeout_s: float) -> str:
        """Return a key that is pressed within a time, '' if none is; arrows as 'up', 'right'..."""
        if not self.is_there:
            select.select([], [], [], timeout_s)
            return ''
        ready, _, _ = select.select([sys.stdin], [], [], timeout_s)
        if not ready:
            return ''
        typed = os.read(sys.stdin.fileno(), _LONGEST_KEY).decode(errors='replace')
        arrows = {'\x1b[A': 'up', '\x1b[B': 'down', '\x1b[C': 'right', '\x1b[D': 'left'}
        return arrows.get(typed, typed[:1])
