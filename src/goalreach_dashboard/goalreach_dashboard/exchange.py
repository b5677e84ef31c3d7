"""Where the ROS thread and the web thread meet: the newest view, and what people ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
import contextlib
import queue
from typing import Any

from goalreach_dashboard.requests import Request
from goalreach_dashboard.views.svg import View


class Board:
    """A notice board: assignments of whole values, and one queue.

    Attributes:
        view: The newest view; replaced as a whole.
        viewers: Number of pages that are open.
        controls: Values for the controls: `paused`, `mode`, `speed`, `noise`, ...; replaced as
            a whole.
        on_view: Called after each new view, in the thread that made it.
    """

    def __init__(self) -> None:
        """Start empty."""
        self.view: View = {}
        self.viewers = 0
        self.controls: dict[str, Any] = {}
        self.on_view: Callable[[], object] | None = None
        self._asked: queue.SimpleQueue[tuple[Request, Future[str]]] = queue.SimpleQueue()

    def show(self, view: View, controls: dict[str, Any]) -> None:
        """Put up a new view and what the controls are to say."""
        self.view, self.controls = view, controls
        if self.on_view is not None:
            self.on_view()

    def ask(self, request: Request) -> Future[str]:
        """Hand a request to the graph; the future gives the answer or the reason of refusal."""
        answer: Future[str] = Future()
        self._asked.put((request, answer))
        return answer

    def asked(self) -> Iterator[tuple[Request, Future[str]]]:
        """Yield what has been asked for since the last call."""
        with contextlib.suppress(queue.Empty):
            while True:
                yield self._asked.get_nowait()
