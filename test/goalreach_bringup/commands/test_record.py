"""The `record` command: which of its two works it does, and its status."""

from __future__ import annotations

from pathlib import Path

import pytest

from goalreach_bags.options import RecordOptions
from goalreach_bringup.cli import main
from small_bags import texts, write_bag

Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize(('whole', 'status'), [(True, 0), (False, 1)])
def test_a_recording_that_lost_something_sets_the_status(
    whole: object, status: int, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    asked: list[RecordOptions] = []

    def record(options: RecordOptions) -> tuple[str, object]:
        asked.append(options)
        return 'recorded', whole

    monkeypatch.setattr('goalreach_bags.ros.recorder.record', record)
    assert main(['record', 'bag']) == status
    assert capsys.readouterr().out == 'recorded\n'
    assert [options.bag for options in asked] == [Path('bag')]


@pytest.mark.parametrize('replace', [False, True])
def test_a_bag_is_repaired_with_or_without_a_copy(
    replace: object, tmp_path: Path, capsys: Capture
) -> None:
    write_bag(tmp_path / 'bag', texts(20, 100_000))
    file = tmp_path / 'bag' / 'bag_0.mcap'
    file.write_bytes(file.read_bytes()[:-300])
    words = ['--replace'] if replace else []
    assert main(['record', '--repair', str(tmp_path / 'bag'), *words]) == 0
    assert capsys.readouterr().out
    assert bool(list((tmp_path / 'bag').glob('*.damaged'))) != replace
    assert main(['bag', 'compare', *[str(tmp_path / 'bag')] * 2]) == 0


def test_repair_needs_a_bag(capsys: Capture) -> None:
    assert main(['record', '--repair']) == 2
    assert '--repair' in capsys.readouterr().err
