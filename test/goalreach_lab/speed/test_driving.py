import pytest

from goalreach_lab.rigs.random_drives import IrSimDrives
from goalreach_lab.speed import driving
from goalreach_msgs_py.arena import Arena


@pytest.fixture
def _two_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    rounds = iter([(4000, 1.0), (4000, 1.6)])
    monkeypatch.setattr(driving, '_drive_all_starts', lambda _seed: next(rounds))


@pytest.mark.usefixtures('_two_rounds')
def test_rows_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('irsim', reason='the extra bench is not installed')
    steps = iter([1000.0, 2000.0])
    monkeypatch.setattr(driving, '_irsim_steps_per_s', lambda _peer, _seed: next(steps))
    cpu = driving.peer_row(2, 0)
    assert (cpu.ours, cpu.reference, cpu.met, cpu.n) == (4000.0, 2000.0, True, 2)
    assert 'from 2.5e+03 to 4e+03; reference from 1e+03 to 2e+03' in cpu.note


@pytest.mark.usefixtures('_two_rounds')
def test_without_the_peer_there_is_no_goal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(driving, 'is_irsim_installed', lambda: False)
    cpu = driving.peer_row(2, 0)
    assert (cpu.reference, cpu.goal) == (None, None)
    assert 'goalreach[bench]' in capsys.readouterr().out


def test_the_peer_has_a_lidar() -> None:
    pytest.importorskip('irsim', reason='the extra bench is not installed')
    peer = IrSimDrives(Arena(), lidar_rays=180)
    assert driving._irsim_steps_per_s(peer, 0) > 0.0
    assert len(peer._environment.get_lidar_scan()['ranges']) == 180


def test_a_round_counts_every_frame() -> None:
    frames, cpu_s = driving._drive_all_starts(0)
    assert frames > 22 * 50
    assert cpu_s > 0.0
