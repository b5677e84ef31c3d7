"""What the page costs, measured on a real run with a real page, for a moment."""

from __future__ import annotations

import pytest

from goalreach_lab.cli import main
from goalreach_lab.speed.dashboard import Options, execute
import graphs

pytest.importorskip('starlette')


@pytest.mark.graph
def test_a_run_is_compared_with_itself_under_a_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', str(graphs.fresh_domain()))
    monkeypatch.setattr('goalreach_lab.speed.dashboard._SETTLE_S', 1.0)  # no figure is judged
    options = Options(browsers=(0,), seconds=3.0, rounds=1, nodes=('composed',))
    rows = {row.name: row for row in execute(options)}
    assert len(rows) == 5
    assert 0.0 <= rows['0 browsers, real time: the page'].ours < 2.0
    page = rows['lockstep, composed: the page']
    assert page.ours > 0.0
    assert '3 clients that paint nothing' in page.note
    assert ' 0.0 frames' not in page.note
    speed = rows['lockstep, composed: speed of the run with its page']
    assert speed.reference is not None
    assert speed.ours > 0.0 < speed.reference


@pytest.mark.parametrize('words', [['--rounds', '0'], ['--seconds', '0'], ['--clients', '0']])
def test_what_makes_no_sense_is_refused(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(['page', *words]) == 2
    assert f'bench: {words[0]}' in capsys.readouterr().err
