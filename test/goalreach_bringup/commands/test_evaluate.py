"""The `evaluate` command: its status, and what it prints and writes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from goalreach_bringup.cli import main
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import write_policy
from goalreach_msgs_py.regions import RegionMap


@pytest.mark.parametrize('quiet', [False, True])
def test_a_path_that_misses_the_goal_sets_the_status(
    quiet: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    q = np.zeros((3, 3, 8))
    q[..., 0] = 1.0  # to the side wall, wherever the robot is
    policy = Policy.of_table(q, RegionMap())
    assert policy is not None
    write_policy(tmp_path / 'aside.json', policy)
    words = f'--starts border:1 --mode crisp --seed 0 --policy {tmp_path}/aside.json'
    if quiet:
        words += f' --quiet --json {tmp_path}/out.json'
    assert main(['evaluate', *words.split()]) == 1
    captured = capsys.readouterr()
    if quiet:
        assert captured.out == captured.err == ''
        summary = json.loads((tmp_path / 'out.json').read_text())
        assert (summary['mode'], summary['seed'], len(summary['paths'])) == ('crisp', 0, 1)
    else:
        assert '0 of 1 paths reached the goal (crisp)' in captured.out
        assert not (tmp_path / 'out.json').exists()
