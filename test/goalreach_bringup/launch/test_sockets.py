"""A default run listens to this machine alone, and shows that by its sockets."""

from importlib.util import find_spec
import os
from pathlib import Path
import socket

import pytest

from goalreach_lab.rigs.processes import Holdings, holdings_of, processes_with
import graphs
from listeners import Listener, listeners_of

PAGE = find_spec('starlette') is not None
COMMAND = ['run', '--clock', 'lockstep', '--start', '1.8,4.4,-90'] + ['--dashboard'] * PAGE


@pytest.mark.graph
def test_nothing_of_a_run_listens_beyond_loopback(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    arguments = [*COMMAND, '--record', str(tmp_path / 'bag')]
    nodes = {'nomad200', 'landmark_localizer', 'state_estimator'}
    with (
        graphs.onlooker(domain) as (node, serve_until),
        graphs.goalreach(arguments, domain=domain, home=tmp_path) as run,
    ):
        assert serve_until(lambda: len(node.get_node_names()) >= 6 + PAGE, 90.0)
        if PAGE:
            assert serve_until(lambda: page_listens(tmp_path), 90.0), run.communicate()[0]
        assert serve_until(lambda: names_of(tmp_path) >= nodes, 90.0), names_of(tmp_path)
        processes = processes_of(tmp_path)
        found = {pid: listeners_of(pid) for pid in processes}
    assert len(processes) >= 6 + PAGE  # four nodes, launcher, recorder, page
    listeners = [listener for several in found.values() for listener in several]
    assert any(listener.protocol == 'udp' for listener in listeners)
    assert any(listener.protocol == 'tcp' for listener in listeners) == PAGE
    assert [listener for listener in listeners if not listener.is_loopback] == []


def processes_of(home: Path) -> dict[int, Holdings]:
    """Return what the processes of a run hold, its launcher's among them."""
    pids = set(processes_with('ROS_LOG_DIR', str(home)))
    pids |= {
        pid
        for path in home.glob('goalreach-*')
        for pid in processes_with('ROS_LOG_DIR', str(path))
    }
    found = {pid: holdings_of(pid) for pid in pids}
    return {pid: holdings for pid, holdings in found.items() if holdings is not None}


def names_of(home: Path) -> set[str]:
    """Return the names of those processes; a node's has its own once it is made."""
    return {holdings.name for holdings in processes_of(home).values()}


def page_listens(home: Path) -> bool:
    """Return whether the page of a run is up."""
    return any(
        listener.protocol == 'tcp' for pid in processes_of(home) for listener in listeners_of(pid)
    )


def test_a_listener_on_every_interface_is_told_from_one_on_loopback() -> None:
    with socket.socket() as everywhere, socket.socket() as here:
        everywhere.bind(('0.0.0.0', 0))  # noqa: S104 - what is to be found
        everywhere.listen()
        here.bind(('127.0.0.1', 0))
        here.listen()
        found = {listener.port: listener for listener in listeners_of(os.getpid())}
    assert not found[everywhere_port(found)].is_loopback
    assert sum(listener.is_loopback for listener in found.values()) >= 1


def test_the_interface_of_a_multicast_group_is_that_of_the_socket() -> None:
    group = socket.inet_aton('239.255.77.1')
    datagram = socket.SOCK_DGRAM
    with socket.socket(type=datagram) as here, socket.socket(type=datagram) as nowhere:
        for one in (here, nowhere):
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            one.bind(('239.255.77.1', 0))
        loopback = group + socket.inet_aton('127.0.0.1')
        here.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, loopback)
        ports = [one.getsockname()[1] for one in (here, nowhere)]
        joined = {listener.port: listener.joined for listener in listeners_of(os.getpid())}
    assert [joined[port] for port in ports] == [('lo',), ()]


def everywhere_port(found: dict[int, Listener]) -> int:
    """Return the port that is open on every interface."""
    return next(port for port, listener in found.items() if listener.address == '0.0.0.0')  # noqa: S104
