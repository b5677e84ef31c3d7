import argparse

import pytest

from goalreach_lab.speed import frames
from goalreach_msgs_py.errors import ConfigurationError


def test_rows_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    rounds = iter([frames._Round(4000, 1.0, 8.0), frames._Round(4000, 1.6, 4.0)])
    monkeypatch.setattr(frames, '_drive', lambda _noise, _seed: next(rounds))
    cpu, wall = frames.execute(argparse.Namespace(rounds=2, noise='nominal', seed=0))
    assert (cpu.ours, cpu.met, cpu.n) == (4000.0, True, 2)
    assert wall.ours == 1000.0
    assert 'median 3250' in cpu.note


def test_a_round_counts_every_frame() -> None:
    done = frames._drive('none', 0)
    assert done.frames > 22 * 50
    assert done.cpu_s > 0.0


def test_refuses_no_rounds() -> None:
    with pytest.raises(ConfigurationError, match='--rounds = 0'):
        frames.execute(argparse.Namespace(rounds=0, noise='none', seed=0))
