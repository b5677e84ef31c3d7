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

_READ_BYTES: Final = 1024
_ARROWS: Final = {'\x1b[A': 'up', '\x1b[B': 'down', '\x1b[C': 'right', '\x1b[D': 'left'}


class Keyboard:
    """Reads keys as they are pressed; knows none where stdin is no terminal."""

    def __init__(self) -> None:
        self.is_there = sys.stdin.isatty()
        self._typed = ''

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
        if not self._typed:
            ready, _, _ = select.select([sys.stdin], [], [], timeout_s)
            if not ready:
                return ''
            self._typed = os.read(sys.stdin.fileno(), _READ_BYTES).decode(errors='replace')
        for sequence, name in _ARROWS.items():
            if self._typed.startswith(sequence):
                self._typed = self._typed[len(sequence) :]
                return name
        key, self._typed = self._typed[:1], self._typed[1:]
        return key
