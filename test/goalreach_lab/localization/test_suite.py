import argparse
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalreach_lab.localization.beliefs import longest_gap_s, wrong_beliefs
from goalreach_lab.localization.frame_log import Frames
from goalreach_lab.localization.input_study import input_rows, study_inputs
from goalreach_lab.localization.long_run import LongRun
from goalreach_lab.localization.long_run_file import drive_on, read_minutes
from goalreach_lab.localization.long_study import _quantile, _summary, long_rows
from goalreach_lab.localization.speed_study import speed_rows
from goalreach_lab.localization.suite import configure, execute
from goalreach_lab.localization.wanderer import Wanderer
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import noise_preset


def options(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument('--seed', type=int, default=0)
    configure(parser)
    return parser.parse_args(arguments)


def frames(*seen: tuple[bool, float]) -> Frames:
    """Return a drive at 25 Hz of which trust and error (in) are given."""
    rows = [(0.04 * k, error, 0.0, 1.0, trusted, 3, 1.0, 0.0, 0) for k, (trusted, error) in
            enumerate(seen)]  # fmt: skip
    return Frames(np.array(rows, dtype=np.float64))


GOOD, WRONG, NONE = (True, 0.5), (True, 9.0), (False, 0.0)


def test_wrong_beliefs_by_hand() -> None:
    (episode,) = wrong_beliefs(frames(GOOD, WRONG, WRONG, NONE, NONE, NONE, GOOD, GOOD))
    assert episode.began_s == pytest.approx(0.04)
    assert episode.detected_s == pytest.approx(0.08)
    assert episode.recovered_s == pytest.approx(0.20)
    assert episode.worst_in == 9.0
    assert wrong_beliefs(frames(GOOD, NONE, GOOD)) == []


def test_a_wrong_belief_that_no_right_one_follows_is_not_recovered() -> None:
    (episode,) = wrong_beliefs(frames(GOOD, WRONG, NONE))
    assert episode.recovered_s == float('inf')


def test_the_longest_gap_by_hand() -> None:
    assert longest_gap_s(frames(NONE, NONE, GOOD, NONE, GOOD, NONE, NONE, NONE, GOOD)) == (
        pytest.approx(0.12)
    )
    assert longest_gap_s(frames(GOOD, GOOD)) == pytest.approx(0.0)
    assert longest_gap_s(frames(NONE)) == float('inf')


def test_who_is_carried_off_notices_nothing() -> None:
    robot = Wanderer((3, 1), noise=noise_preset('nominal'))
    before = robot.step().frame
    robot.carry_off()
    frame = robot.simulator.sense()
    assert frame.odometry.pose == before.odometry.pose
    assert frame.joints.turret_rad == pytest.approx(before.joints.turret_rad)
    assert frame.truth.pose.x_m != before.truth.pose.x_m


def test_bad_inputs_make_no_good_pose_and_one_reason() -> None:
    rows = input_rows(study_inputs(seed=0))
    assert [row.met for row in rows[:2]] == [True, True]
    assert rows[0].n == 25


def test_a_long_drive_that_was_interrupted_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from goalreach_lab.localization import long_run, long_run_file

    monkeypatch.setattr(long_run, 'FRAMES_PER_MINUTE', 60)
    monkeypatch.setattr(long_run_file, '_KEEP_EVERY', 2)
    whole = drive_on(tmp_path / 'whole.jsonl', minutes=4, seed=1)
    path = tmp_path / 'parts.jsonl'
    drive_on(path, minutes=3, seed=1)
    with path.open('a', encoding='utf-8') as file:
        file.write('{"minute": 4, "goo')
    assert len(read_minutes(path)) == 3
    assert drive_on(path, minutes=4, seed=1) == whole


def test_hours_of_minutes_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    from goalreach_lab.localization import long_run

    monkeypatch.setattr(long_run, 'FRAMES_PER_MINUTE', 60)
    minute: dict[str, Any] = LongRun(0).drive() | {
        'good': 1000,
        'bins': [0, 500, 500],
        'rms_in': 0.1,
        'region_wrong': 10,
        'odometry_region_wrong': 0,
    }
    found = _summary([minute, minute | {'odometry_region_wrong': 750, 'rms_in': 0.3}])
    assert found['hours'][0]['rms_in'] == pytest.approx(np.sqrt((0.01 + 0.09) / 2))
    assert found['hours'][0]['p95_in'] == pytest.approx(0.145)
    assert found['first_wrong_min'] == 2
    assert found['odometry_wrong_share'] == 0.5
    assert found['vision_wrong_share'] == 0.01
    rows = {row.name: row for row in long_rows(found)}
    assert (
        rows['odometry alone: minute in which its region is wrong for a tenth of the time'].ours
        == 2.0
    )
    assert _quantile(np.array([4.0, 0.0, 4.0]), 0.75) == pytest.approx(0.125)


def test_rows_of_speed_by_hand() -> None:
    def figures(value: float) -> dict[str, float]:
        return dict.fromkeys(('rms', 'median', 'p95', 'max'), value)

    names = ('ours, tracking', 'ours, one image', 'SimpleBlobDetector + solveP3P')
    found = {
        'frames': 5,
        'ms': dict(zip(names, map(figures, (0.2, 1.3, 0.6)), strict=True)),
        'in': dict(zip(names, map(figures, (0.3, 0.4, 0.6)), strict=True)),
    }
    rows = {row.name: row for row in speed_rows(found)}
    assert rows['tracking frame, all of it, median'].met is True
    assert rows['acquisition, all of it, median'].met is False
    peer = rows['tracking frame, median, beside SimpleBlobDetector + solveP3P']
    assert peer.ratio == pytest.approx(1.0 / 3.0)
    assert peer.met is True


SMALL = (
    *('--bound-images', '40', '--labelled-images', '1', '--runs', '2', '--run-seconds', '6'),
    *('--kidnaps', '2', '--hours', '0.03', '--frames', '3', '--noise-robots', '1'),
)


def test_parts_are_kept_and_written_with_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from goalreach_lab.localization import bound_study, long_run

    monkeypatch.setattr(long_run, 'FRAMES_PER_MINUTE', 60)
    monkeypatch.setattr(bound_study, '_COLUMNS', 3)
    monkeypatch.setattr(bound_study, '_ROWS', 4)
    arguments = (
        *('--part', 'bound', 'consistency', 'kidnap', 'speed', 'long', *SMALL),
        *('--results', str(tmp_path / 'kept')),
    )
    rows = execute(options(*arguments))
    assert rows
    document, figures = tmp_path / 'L.md', tmp_path / 'figures'
    again = execute(
        options(*arguments, '--as-it-is', '--out', str(document), '--figures', str(figures))
    )
    assert [row.to_json() for row in again] == [row.to_json() for row in rows]
    text = document.read_text(encoding='utf-8')
    assert '## One image beside the bound' in text
    assert '(figures/localization_day.png)' in text
    assert '## Driving to the goal' not in text
    drawn = {path.name for path in figures.iterdir()}
    assert {'localization_bound.svg', 'localization_kidnap.png'} <= drawn


@pytest.mark.parametrize(
    ('arguments', 'name'),
    [(('--kidnaps', '0'), '--kidnaps'), (('--jobs', '0'), '--jobs'), (('--as-it-is',), '--as')],
)
def test_refuses_what_cannot_be(arguments: tuple[str, ...], name: str) -> None:
    with pytest.raises(ConfigurationError, match=name):
        execute(options(*arguments))
