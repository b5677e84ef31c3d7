"""The whole loop in one process."""

import json
from pathlib import Path

import numpy as np
import pytest

from goalreach_bringup.cli import main
from goalreach_evaluation.evaluation import EvaluationPlan, drive_sessions
from goalreach_evaluation.starts import random_starts
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset

ARENA = Arena()
POLICY = train(ARENA, rng=np.random.default_rng(1)).policy


def plan(
    mode: str = 'fuzzy', noise: str = 'nominal', starts: int = 4, seed: int = 1
) -> EvaluationPlan:
    return EvaluationPlan(
        arena=ARENA,
        noise=noise_preset(noise),
        policy=POLICY,
        controller=ControllerConfig(mode=mode),
        starts=random_starts(ARENA, starts, np.random.default_rng(3)),
        seed=seed,
    )


@pytest.mark.parametrize('mode', ['fuzzy', 'crisp'])
def test_random_starts_reach_the_goal_on_images(mode: str) -> None:
    (session,) = drive_sessions(plan(mode, starts=6))
    assert [path.outcome for path in session.paths] == ['goal'] * 6
    assert max(path.pose_error_m['p95'] for path in session.paths) < 3 * INCH_M


def test_without_noise_the_pose_is_nearly_exact() -> None:
    (session,) = drive_sessions(plan(noise='none', starts=3))
    assert max(path.pose_error_m['rms'] for path in session.paths) < 0.2 * INCH_M


def test_the_same_seed_gives_the_same_run_and_another_seed_another() -> None:
    first, again, other = (drive_sessions(plan(seed=seed, starts=2)) for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_the_number_of_processes_changes_nothing() -> None:
    many = plan(starts=24)
    assert drive_sessions(many, jobs=2) == drive_sessions(many)


def test_the_command_writes_what_it_drove(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'evaluation.json'
    status = main(['evaluate', '--starts', 'random:2', '--json', str(path), '--seed', '4'])
    summary = json.loads(path.read_text())
    assert status == 0
    assert '2 of 2 paths reached the goal' in capsys.readouterr().out
    assert (summary['seed'], summary['mode'], summary['success_rate']) == (4, 'fuzzy', 1.0)
    assert summary['config']['frames'] > 100
