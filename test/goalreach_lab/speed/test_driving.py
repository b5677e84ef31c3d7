import pytest

from goalreach_lab.rigs.random_drives import IrSimDrives
from goalreach_lab.speed import driving
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError


@pytest.fixture
def _two_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    rounds = iter([driving._Round(4000, 1.0, 8.0), driving._Round(4000, 1.6, 4.0)])
    monkeypatch.setattr(driving, '_drive_all_starts', lambda _noise, _seed: next(rounds))


OPTIONS = driving.Options(rounds=2)


@pytest.mark.usefixtures('_two_rounds')
def test_rows_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('irsim', reason='the extra bench is not installed')
    steps = iter([1000.0, 2000.0])
    monkeypatch.setattr(driving, '_irsim_steps_per_s', lambda _peer, _seed: next(steps))
    cpu, wall = driving.execute(OPTIONS)
    assert (cpu.ours, cpu.reference, cpu.met, cpu.n) == (4000.0, 2000.0, True, 2)
    assert wall.ours == 1000.0
    assert 'from 2.5e+03 to 4e+03; reference from 1e+03 to 2e+03' in cpu.note


@pytest.mark.usefixtures('_two_rounds')
def test_without_the_peer_there_is_no_goal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(driving, 'is_irsim_installed', lambda: False)
    cpu, _ = driving.execute(OPTIONS)
    assert (cpu.reference, cpu.goal) == (None, None)
    assert 'goalreach[bench]' in capsys.readouterr().out


def test_the_peer_has_a_lidar() -> None:
    pytest.importorskip('irsim', reason='the extra bench is not installed')
    peer = IrSimDrives(Arena(), lidar_rays=180)
    assert driving._irsim_steps_per_s(peer, 0) > 0.0
    assert len(peer._environment.get_lidar_scan()['ranges']) == 180


def test_a_round_counts_every_frame() -> None:
    done = driving._drive_all_starts('none', 0)
    assert done.frames > 22 * 50
    assert done.cpu_s > 0.0


def test_refuses_no_rounds() -> None:
    with pytest.raises(ConfigurationError, match='--rounds = 0'):
        driving.Options(rounds=0)
