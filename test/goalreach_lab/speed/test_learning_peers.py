import pytest

from goalreach_lab.speed import learning_peers
from goalreach_msgs_py.errors import ConfigurationError


def test_without_peers_the_rows_say_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for peer in ('irsim', 'sb3'):
        monkeypatch.setattr(learning_peers, f'is_{peer}_installed', lambda: False)
    (row,) = learning_peers.execute(learning_peers.Options(rounds=1))
    assert row.ours > 0.0
    assert row.reference is None
    told = capsys.readouterr().out
    assert 'goalreach[sb3]' in told
    assert 'goalreach[bench]' in told


def test_rows_beside_dqn_by_hand() -> None:
    seconds, paths = learning_peers._dqn_rows([0.01, 0.03], [(4.0, 900.0), (2.0, 300.0)])
    assert seconds.ratio == pytest.approx(0.02 / 3.0)
    assert (paths.reference, paths.ours) == (600.0, 440.0)


def test_refuses_no_rounds() -> None:
    with pytest.raises(ConfigurationError, match='--rounds = 0'):
        learning_peers.Options(rounds=0)
