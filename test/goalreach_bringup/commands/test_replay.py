"""The `replay` command: which of its two works it does, and its status."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from goalreach_bags.compare import TopicResult
from goalreach_bags.options import ReplayOptions
from goalreach_bringup.cli import main

Capture = pytest.CaptureFixture[str]


def test_a_bag_is_played(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    asked: list[ReplayOptions] = []

    def replay(options: ReplayOptions) -> str:
        asked.append(options)
        return 'played'

    monkeypatch.setattr('goalreach_bags.ros.player.replay', replay)
    assert main(['replay', 'bag', '--rate', '2']) == 0
    assert capsys.readouterr().out == 'played\n'
    assert [(options.bag, options.rate) for options in asked] == [(Path('bag'), 2.0)]


@pytest.mark.parametrize(('different', 'status'), [(0, 0), (1, 1)])
def test_a_topic_that_differs_when_it_is_computed_again_sets_the_status(
    different: int, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    asked: list[dict[str, Any]] = []

    def recompute(bag: Path, **options: Any) -> list[TopicResult]:  # noqa: ANN401 - its options
        asked.append({'bag': bag, **options})
        return [TopicResult('/pose', 3), TopicResult('/state', 3, different)]

    monkeypatch.setattr('goalreach_bags.ros.recompute.recompute', recompute)
    params = tmp_path / 'a.yaml'
    params.write_text('/**: {ros__parameters: {use_sim_time: true}}')
    words = ['--recompute', '--tolerance', '0.5', '--params-file', str(params), '--quiet']
    assert main(['replay', 'bag', *words]) == status
    assert 'the same within 0.5' in capsys.readouterr().out
    assert asked == [{'bag': Path('bag'), 'tolerance': 0.5, 'params_file': params, 'quiet': True}]
