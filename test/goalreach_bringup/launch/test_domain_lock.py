"""One stack per ROS domain and machine, whoever started the other one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import pwd
import re
import signal
import socket
import subprocess
import sys

import pytest

from goalreach_bringup.launch.environment import domain_lock, unused_domains
from goalreach_msgs_py.errors import GoalreachError
import graphs

LOCKING = """
import os, sys
from goalreach_bringup.cli import guarded
from goalreach_bringup.launch.environment import domain_lock, unused_domains

uid = int(sys.argv[1])
next(unused_domains())  # imports its codec: the second user may be unable to read this Python
if uid != os.getuid():
    os.setgroups([])
    os.setgid(uid)
    os.setuid(uid)

def execute():
    with domain_lock():
        print('locked', flush=True)
        sys.stdin.read()
    return 0

sys.exit(guarded('second', execute))
"""
NOBODY = pwd.getpwnam('nobody')
SECOND_USERS = [
    pytest.param(pwd.getpwuid(os.getuid()), id='same user'),
    pytest.param(
        NOBODY,
        id='another user',
        marks=pytest.mark.skipif(os.getuid() != 0, reason='only root can become another user'),
    ),
]


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    number = graphs.fresh_domain()
    monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
    return number


def start(user: pwd.struct_passwd) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, '-c', LOCKING, str(user.pw_uid)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@contextmanager
def holder(user: pwd.struct_passwd) -> Iterator[subprocess.Popen[str]]:
    """Give a process of a user that holds the lock of the test's domain."""
    with start(user) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == 'locked\n'
            yield process
        finally:
            process.kill()


def refusal(domain: int, pid: int, user: str) -> str:
    return (
        rf'ROS_DOMAIN_ID = {domain}: another graph runs there \(process {pid} of user {user}\); '
        r'stop it, or start this one with ROS_DOMAIN_ID=(\d+)'
    )


@pytest.mark.parametrize('user', SECOND_USERS)
def test_a_second_holder_is_refused_in_one_line(user: pwd.struct_passwd, domain: int) -> None:
    me = pwd.getpwuid(os.getuid()).pw_name
    with domain_lock():
        out, error = (second := start(user)).communicate('')

    assert (second.returncode, out) == (2, '')
    line = re.fullmatch(f'second: {refusal(domain, os.getpid(), me)}\n', error)
    assert line, error
    assert int(line[1]) != domain


@pytest.mark.parametrize('user', SECOND_USERS)
def test_a_run_is_refused_and_the_domain_it_is_told_is_accepted(
    user: pwd.struct_passwd, domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with holder(user) as first:
        arguments = ['run', '--paths', '1', '--clock', 'lockstep', '--quiet']
        with graphs.goalreach(arguments, domain=domain, home=tmp_path) as run:
            told, _ = run.communicate(timeout=60.0)
        expected = f'^goalreach run: {refusal(domain, first.pid, user.pw_name)}$'
        line = re.search(expected, told, re.MULTILINE)
        assert run.returncode == 2
        assert line, told
        monkeypatch.setenv('ROS_DOMAIN_ID', line[1])
        with domain_lock():
            pass


@pytest.mark.parametrize('user', SECOND_USERS)
def test_the_lock_ends_with_its_process(user: pwd.struct_passwd, domain: int) -> None:
    with holder(user) as first:
        with pytest.raises(GoalreachError, match=f'process {first.pid} of user'), domain_lock():
            pass
        first.send_signal(signal.SIGKILL)
        first.wait()
        with domain_lock():
            assert domain not in unused_domains()
    assert domain in unused_domains()


@pytest.mark.usefixtures('domain')
def test_it_is_not_inherited_by_the_processes_of_a_run() -> None:
    with domain_lock():
        child = subprocess.Popen(['cat'], stdin=subprocess.PIPE, close_fds=False)
    with domain_lock():
        assert child.poll() is None
    child.communicate()


def test_a_holder_that_has_answered_too_often_is_unknown(domain: int) -> None:
    with socket.socket(socket.AF_UNIX) as mute:
        mute.bind(f'\0goalreach-domain-{domain}')  # does not listen
        with pytest.raises(GoalreachError, match=r'\(process unknown\); stop it'), domain_lock():
            pass


def test_a_domain_with_a_participant_is_not_offered(domain: int) -> None:
    assert domain in unused_domains()
    with graphs.onlooker(domain):
        assert domain not in unused_domains()
