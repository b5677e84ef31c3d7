"""The suite on the simulator, with few of everything."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from goalreach_lab.cli import main
from goalreach_lab.rigs.random_drives import IrSimDrives, RandomDrives, drive_batch
from goalreach_lab.speed import simulator
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError

OPTIONS = simulator.Options(seed=1, robots=50, images=5, drives=20, graph_seconds=0.0)


def test_every_figure_is_there_and_finds_no_flaw() -> None:
    rows = simulator.execute(OPTIONS)
    flaws = [row for row in rows if row.name.startswith('random drives')]
    assert len(rows) == 8
    assert len(flaws) == 5
    assert all(row.met for row in flaws)
    assert [row.n for row in flaws] == [20] * 5
    assert all(row.ours > 0.0 for row in rows[:3])


def test_says_what_to_install_where_the_peer_is_missing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(simulator, 'is_irsim_installed', lambda: False)
    rows = simulator.execute(OPTIONS)
    assert 'pip install goalreach[bench]' in capsys.readouterr().out
    assert rows[0].reference is None
    assert rows[0].met is None


@pytest.mark.parametrize('name', ['robots', 'images', 'drives'])
def test_refuses_less_than_one(name: str) -> None:
    bad: dict[str, Any] = {name: 0}
    with pytest.raises(ConfigurationError, match=f'--{name}'):
        replace(OPTIONS, **bad)


def test_the_command_knows_the_suite(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(['simulator', '--help'])
    assert '--graph-seconds' in capsys.readouterr().out


def test_drives_are_the_same_for_the_same_seed_and_stay_inside() -> None:
    one, again = (RandomDrives.draw(40, Arena(), np.random.default_rng(3)) for _ in range(2))
    ends = drive_batch(one, Arena())
    assert (ends == drive_batch(again, Arena())).all()
    assert (np.abs(ends - one.starts)[:2].max(axis=0) > 0.01).all()
    assert all(Arena().is_free(x, y, body_radius_m=0.2249) for x, y, _ in ends.T.tolist())


def test_the_peer_drives_the_same_drives() -> None:
    pytest.importorskip('irsim', reason='the extra bench is not installed')
    drives = RandomDrives.draw(12, Arena(), np.random.default_rng(3))
    ends, peer = drive_batch(drives, Arena()), IrSimDrives(Arena())
    gaps_m = []
    for index in range(12):
        peer.place(drives, index)
        gaps_m.append(np.hypot(*(peer.drive(drives, index) - ends[:, index])[:2]))
    assert np.median(gaps_m) < 0.05
