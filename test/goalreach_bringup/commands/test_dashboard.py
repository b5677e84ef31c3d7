"""The `dashboard` command: on which socket, and for whom, it serves the page."""

from __future__ import annotations

from collections.abc import Iterator
import re
import socket
from types import SimpleNamespace
from typing import Any

import pytest

from goalreach_bringup.cli import main
from goalreach_dashboard.address import TOKEN_VARIABLE

pytest.importorskip('starlette')
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Give what the server is started with; it returns at once."""
    found = SimpleNamespace()

    def serve(listener: socket.socket, **options: Any) -> int:  # noqa: ANN401 - its options
        vars(found).update(options, listener=listener, address=listener.getsockname()[:2])
        return 7

    monkeypatch.setattr('goalreach_dashboard.web.server.serve', serve)
    yield found
    if hasattr(found, 'listener'):
        found.listener.close()


def test_on_this_machine_the_page_needs_no_token(served: Any, capsys: Capture) -> None:  # noqa: ANN401
    assert main(['dashboard', '--port', '0', '--arena', 'narrow', '--robot', '/robot1']) == 7
    host, port = served.address
    assert capsys.readouterr().out == f'live page: http://{host}:{port}/\n'
    assert (host, served.token, served.local) == ('127.0.0.1', None, True)
    assert (served.arena.name, served.robot, served.events) == ('narrow', 'robot1', None)


def test_for_other_machines_it_prints_a_link_with_a_token(served: Any, capsys: Capture) -> None:  # noqa: ANN401
    assert main(['dashboard', '--host', '0.0.0.0', '--port', '0']) == 7  # noqa: S104
    link = re.fullmatch(r'live page: .*:(\d+)/#token=(.*)\n', capsys.readouterr().out)
    assert link
    assert (int(link[1]), link[2], served.local) == (served.address[1], served.token, False)
    assert len(served.token) >= 32  # 192 bits


def test_a_launcher_hands_over_its_socket_and_its_token(
    served: Any,  # noqa: ANN401
    monkeypatch: pytest.MonkeyPatch,
    capsys: Capture,
) -> None:
    monkeypatch.setenv(TOKEN_VARIABLE, 'secret')
    with socket.create_server(('127.0.0.1', 0)) as listener:
        address = listener.getsockname()
        assert main(['dashboard', '--listener', str(listener.detach())]) == 7
    assert (served.address, served.token) == (address, 'secret')
    assert capsys.readouterr().out == ''


def test_a_bad_robot_is_refused_in_one_line(served: Any, capsys: Capture) -> None:  # noqa: ANN401
    assert main(['dashboard', '--robot', 'a//b']) == 2
    assert "--robot = 'a//b': must be a ROS 2 namespace" in capsys.readouterr().err
    assert not hasattr(served, 'listener')
