"""Random combinations of the environment variables of ROS 2, for real processes over real DDS.

Each process ends with status 0 and has done its work, or with one clear line and another status;
never with a traceback, never without end. The gate draws 12 combinations; all 60 by

    GOALREACH_COMBINATIONS=60 python3 scripts/run_tests.py -- -k random_variables
"""

from collections.abc import Sequence
import os
from pathlib import Path
import re
import subprocess
import sys
import tempfile
from typing import TypeVar

import numpy as np
import pytest

from goalreach_bringup.launch.environment import unused_domains
from goalreach_msgs_py.ros.dds_profile import DISCOVERY_PROFILE, fast_dds_profile
import graphs

ValueT = TypeVar('ValueT')
SEED = 17
COMBINATIONS = int(os.environ.get('GOALREACH_COMBINATIONS', '12'))
BAD_SHARE = 0.03  # of the variables: about half of the combinations have none
COMMANDS = {
    'run': 'run --paths 1 --clock lockstep --policy paper --no-dashboard',
    'doctor': 'doctor',
    'ros2': 'ros2 topic list --spin-time 1',
}
FLAG = ((None, '', '0', '1'), ('yes', '2', '-1'))
PROFILE = (
    (None, '', fast_dds_profile(), DISCOVERY_PROFILE),
    ('FIFO', 'FOLDER', '/no', '/dev/zero'),
)
LOGS = (('FOLDER', 'FOLDER/new'), ('FILE', 'FILE/x', '/dev/null'))
VALUES = {
    'ROS_DOMAIN_ID': (('DOMAIN',), ('abc', '-1', '233', '0000000999', '1e2', '٣')),
    'RMW_IMPLEMENTATION': ((None, '', 'rmw_fastrtps_cpp'), ('rmw_none_cpp', '/etc', 'a\nb')),
    'RCL_ASSERT_RMW_ID_MATCHES': ((None, '', 'rmw_fastrtps_cpp'), ('rmw_none_cpp',)),
    'ROS_AUTOMATIC_DISCOVERY_RANGE': (
        (None, '', 'LOCALHOST', 'SUBNET', 'SYSTEM_DEFAULT'),
        ('OFF', 'subnet'),
    ),
    'ROS_STATIC_PEERS': ((None, '', '127.0.0.1', ';localhost;'), ('::1', 'no host', '300.1.1.1')),
    'ROS_LOCALHOST_ONLY': FLAG,
    'FASTRTPS_DEFAULT_PROFILES_FILE': PROFILE,
    'FASTDDS_DEFAULT_PROFILES_FILE': PROFILE,
    'FASTDDS_ENVIRONMENT_FILE': ((None, ''), ('FIFO', '/no')),
    'FASTDDS_BUILTIN_TRANSPORTS': ((None, '', 'DEFAULT', 'SHM', 'UDPv4'), ('NONE', 'x')),
    'FASTDDS_STATISTICS': ((None, '', 'DATA_COUNT_TOPIC'), ()),
    'SKIP_DEFAULT_XML_FILE': FLAG,
    'ROS_DISCOVERY_SERVER': ((None, ''), (';', 'a b')),
    'ROS_SUPER_CLIENT': ((None, '', 'true', '0'), ('maybe',)),
    'ROS_DISABLE_LOANED_MESSAGES': FLAG,
    'RMW_FASTRTPS_USE_QOS_FROM_XML': FLAG,
    'RMW_FASTRTPS_PUBLICATION_MODE': (
        (None, '', 'AUTO', 'SYNCHRONOUS', 'ASYNCHRONOUS'),
        ('sync',),
    ),
    'ROS_HOME': LOGS,
    'ROS_LOG_DIR': ((*LOGS[0], ''), LOGS[1]),
    'TMPDIR': ((None, '', 'FOLDER', '/no/such', 'FILE'), ('LONG',)),
    'RCL_LOGGING_SPDLOG_EXPERIMENTAL_OLD_FLUSHING_BEHAVIOR': FLAG,
    'RCUTILS_LOGGING_USE_STDOUT': FLAG,
    'RCUTILS_LOGGING_BUFFERED_STREAM': FLAG,
    'RCUTILS_COLORIZED_OUTPUT': FLAG,
    'RCUTILS_CONSOLE_OUTPUT_FORMAT': ((None, '', '{message}', '{', '{x}' * 900), ()),
    'ROS_SECURITY_ENABLE': ((None, '', 'false'), ('TRUE', 'on')),
    'ROS_SECURITY_STRATEGY': ((None, '', 'Enforce', 'Permissive'), ('strict',)),
    'ROS_SECURITY_KEYSTORE': ((None, '', 'FOLDER', '/no'), ()),
    'ROS_SECURITY_ENCLAVE_OVERRIDE': ((None, '', '/goalreach'), ('goalreach',)),
    'COLUMNS': ((None, '', '0', '1', '40', 'wide', '²', '-3', '9' * 5000), ()),
    'LINES': ((None, '', '0', 'x'), ()),
}
"""Values by variable: good ones, None for unset; and ones that are to be refused."""


def unused_domain() -> int:
    return next(unused_domains(graphs.fresh_domain()))


def pick(values: Sequence[ValueT], rng: np.random.Generator) -> ValueT:
    return values[int(rng.integers(len(values)))]


def combination(number: int, domain: int, folder: Path) -> tuple[str, dict[str, str], set[str]]:
    """Return a command, its variables, and the names of those with bad values."""
    rng = np.random.default_rng([SEED, number])
    pieces = {'FOLDER': folder / 'f', 'FIFO': folder / 'fifo', 'FILE': folder / 'file'}
    pieces['LONG'] = folder / ('long' * 40)
    for name in ('FOLDER', 'LONG'):
        pieces[name].mkdir()
    os.mkfifo(pieces['FIFO'])
    pieces['FILE'].touch()
    words = {**{name: str(path) for name, path in pieces.items()}, 'DOMAIN': str(domain)}
    given, bad = {}, set()
    for name, (good, refused) in VALUES.items():
        is_bad = bool(refused) and rng.random() < BAD_SHARE
        value = pick(refused if is_bad else good, rng)
        if is_bad:
            bad.add(name)
        if value is not None:
            given[name] = re.sub('[A-Z]{4,}', lambda found: words.get(found[0], found[0]), value)
    return pick((*COMMANDS, 'run'), rng), given, bad


def start(
    command: str, variables: dict[str, str], folder: Path
) -> subprocess.CompletedProcess[str]:
    inherited = {name: value for name, value in os.environ.items() if name not in VALUES}
    return subprocess.run(
        [sys.executable, '-m', 'goalreach_bringup.cli', *COMMANDS[command].split()],
        cwd=folder,
        env={**inherited, **variables},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=100.0,
        check=False,
    )


@pytest.mark.graph
@pytest.mark.parametrize('number', range(COMBINATIONS))
def test_any_combination_works_or_is_refused_in_one_line(number: int) -> None:
    with tempfile.TemporaryDirectory() as folder:  # shorter than `tmp_path`, for sockets
        command, variables, bad = combination(number, unused_domain(), Path(folder))
        done = start(command, variables, Path(folder))

    shown = f'{command}: {variables}\n{done.stdout}\n{done.stderr}'
    assert 'Traceback' not in done.stdout + done.stderr, shown
    if command == 'doctor':
        wrong = re.findall('^wrong +.*', done.stdout, re.MULTILINE)
        assert (done.returncode, done.stderr) == (1 if bad else 0, ''), shown
        assert all(any(f' {name} = ' in line for name in bad) for line in wrong), shown
        assert bool(wrong) == bool(bad), shown
    elif bad:
        assert (done.returncode, done.stdout) == (2, ''), shown
        assert re.fullmatch(rf'goalreach {command}: (\w+) = .*: must be .*\n', done.stderr), shown
        assert done.stderr.split()[2] in bad, shown
    else:
        assert done.returncode == 0, shown
        assert ('1 of 1 paths reached' if command == 'run' else '/rosout') in done.stdout, shown
