from pathlib import Path
import pickle

import numpy as np
import pytest

from goalreach_lab.localization import long_drive_study as module
from goalreach_lab.localization.long_drive_study import (
    LongDrive,
    analyse_minutes,
    long_drive_rows,
    long_drive_study,
    quantile_in,
)
from goalreach_lab.study import run_study

ODOMETRY = 'odometry alone: minute in which its region is wrong for a tenth of the time'


@pytest.fixture(autouse=True)
def short_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, 'FRAMES_PER_MINUTE', 60)
    monkeypatch.setattr(module, '_CHECKPOINT_MINUTES', 2)


def test_an_interrupted_drive_resumes(tmp_path: Path) -> None:
    def minutes(count: int, folder: Path | None) -> list[dict[str, object]]:
        return run_study(long_drive_study(hours=count / 60, seed=1, folder=folder), folder)

    whole = minutes(4, None)
    assert [minute['minute'] for minute in whole] == [1, 2, 3, 4]
    minutes(3, tmp_path)
    with (tmp_path / 'long.jsonl').open('a', encoding='utf-8') as file:
        file.write('{"minute": 4, "goo')
    assert minutes(4, tmp_path) == whole
    (tmp_path / 'long.jsonl').unlink()
    assert minutes(4, tmp_path) == whole
    (tmp_path / 'long.jsonl').unlink()
    (tmp_path / 'long.checkpoint').write_bytes(b'cut off')
    assert minutes(1, tmp_path) == whole[:1]


def test_a_robot_of_other_code_is_not_driven_on(tmp_path: Path) -> None:
    other = LongDrive(1)
    other.minutes, other.code = 2, 'older'
    (tmp_path / 'long.checkpoint').write_bytes(pickle.dumps(other))
    driven = run_study(long_drive_study(hours=3 / 60, seed=1, folder=tmp_path), tmp_path)
    assert [minute['minute'] for minute in driven] == [1, 2, 3]
    assert driven == run_study(long_drive_study(hours=3 / 60, seed=1, folder=None))


def test_hours_of_minutes_by_hand() -> None:
    minute = LongDrive(0).drive() | {
        'good': 1000,
        'bins': [0, 500, 500],
        'rms_in': 0.1,
        'region_wrong': 10,
        'odometry_region_wrong': 0,
    }
    found = analyse_minutes([minute, minute | {'odometry_region_wrong': 30, 'rms_in': 0.3}])
    assert found['hours'][0]['rms_in'] == pytest.approx(np.sqrt((0.01 + 0.09) / 2))
    assert found['hours'][0]['p95_in'] == pytest.approx(0.145)
    assert found['first_wrong_min'] == 2
    assert found['odometry_wrong_share'] == 0.5
    assert found['vision_wrong_share'] == 0.01
    rows = {row.name: row for row in long_drive_rows(found)}
    assert rows[ODOMETRY].ours == 2.0
    never = long_drive_rows(analyse_minutes([minute]))  # shorter than the ten minutes of the goal
    assert {row.name: row.met for row in never}[ODOMETRY] is False


def test_quantiles_of_a_histogram_by_hand() -> None:
    assert quantile_in(np.array([4.0, 0.0, 4.0]), 0.75) == pytest.approx(0.125)
