import socket

import pytest

from goalreach_dashboard.address import bind, is_loopback, url
from goalreach_msgs_py.errors import GoalreachError


def test_addresses_are_as_a_person_types_them() -> None:
    assert url('127.0.0.1', 8080) == 'http://127.0.0.1:8080/'
    assert url('::1', 80, 'abc') == 'http://[::1]:80/#token=abc'
    assert is_loopback('localhost')
    assert not is_loopback('0.0.0.0')  # noqa: S104 - nothing is bound


def test_a_port_that_is_taken_is_refused_and_another_found() -> None:
    with bind('127.0.0.1', 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(GoalreachError, match=f'127.0.0.1:{port}: cannot listen'):
            bind('127.0.0.1', port)
        with bind('127.0.0.1', None) as free:
            assert isinstance(free, socket.socket)
            assert free.getsockname()[1] != port


def test_an_address_of_another_machine_is_refused_with_the_port_asked_for() -> None:
    for port, named in ((0, 0), (9, 9), (None, 8080)):
        with pytest.raises(GoalreachError, match=f'^192.0.2.1:{named}: cannot listen'):
            bind('192.0.2.1', port)
