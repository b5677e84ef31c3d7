"""The words of `bag`, on small bags."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure
import numpy as np
import pytest

from goalreach_bags.run_figures import RunSeries
from goalreach_bringup.cli import main
from goalreach_msgs_py.diagnostic_messages import q_table_to_raw, state_to_raw
from goalreach_msgs_py.pose_messages import estimate_to_raw, odometry_to_raw, twist_to_raw
from goalreach_msgs_py.topics import CMD_VEL, GROUND_TRUTH, POSE, Q_TABLE, STATE
from goalreach_msgs_py.values import Confidence, Odometry, Pose2, PoseEstimate, RegionState, Twist2
from small_bags import string_topic, text_message, texts, write_bag

Capture = pytest.CaptureFixture[str]
POSES = [Pose2(x_m=1.0 + 0.1 * k, y_m=2.0, heading_rad=0.1) for k in range(3)]


def write_run(path: Path) -> None:
    twist = Twist2(linear_m_per_s=0.3, steering_rad_per_s=0.0)
    messages = [(Q_TABLE, 1, q_table_to_raw(np.ones((3, 3, 8))))]
    for tick, pose in enumerate(POSES):
        ns = (tick + 1) * 40_000_000
        state = RegionState(
            region=(1, 1), mu_x=(0.0, 1.0, 0.0), mu_y=(0.0, 1.0, 0.0), pose=pose,
            goal_probability=0.0, confidence=Confidence.OK,
        )  # fmt: skip
        truth = Odometry(pose=pose, twist=twist)
        messages += [
            (GROUND_TRUTH, ns, odometry_to_raw(truth, ns, frame_id='map')),
            (POSE, ns, estimate_to_raw(PoseEstimate(pose=pose, covariance=np.eye(3)), ns)),
            (STATE, ns, state_to_raw(state, ns)),
            (CMD_VEL, ns, twist_to_raw(twist, ns)),
        ]
    names = (Q_TABLE, GROUND_TRUTH, POSE, STATE, CMD_VEL)
    write_bag(path, messages, topics=[string_topic(name) for name in names])


def test_info_reads_all_of_a_bag_where_it_is_asked_to(tmp_path: Path, capsys: Capture) -> None:
    write_bag(tmp_path / 'bag', texts(3))
    for words, state in (([], 'sound'), (['--check'], 'sound'), (['--no-check'], 'not checked')):
        assert main(['bag', 'info', str(tmp_path / 'bag'), *words]) == 0
        assert f'state:      {state}' in capsys.readouterr().out


def one_figure(series: RunSeries) -> dict[str, Figure]:
    """Return a figure that is drawn at once; those of a run have tests of their own."""
    return {f'{len(series.time_s)} ticks': Figure(figsize=(1.0, 1.0))}


def test_figures_are_written_beside_the_bag_or_where_they_are_wanted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    write_run(tmp_path / 'bag')
    monkeypatch.chdir(tmp_path / 'bag')
    monkeypatch.setattr('goalreach_bags.run_figures.run_figures', one_figure)
    for words, folder in (([], tmp_path / 'bag-figures'), (['--out', 'here'], Path('here'))):
        assert main(['bag', 'plot', '.', *words]) == 0
        told = capsys.readouterr().out.splitlines()
        assert Path(folder, '3 ticks.svg') in map(Path, told)
        assert sorted(told) == sorted(map(str, folder.iterdir()))


def two_bags(folder: Path) -> tuple[str, str]:
    """Write bags that differ in `/a`, in `/rosout`, and in the times of `/late`."""
    for name, text, late_ns in (('first', 'x', 0), ('second', 'y', 1_000_000)):
        messages = [
            (topic, k, text_message(content))
            for k, (topic, content) in enumerate(
                [('/a', text), ('/same', 'z'), ('/rosout', text)], start=1
            )
        ]
        messages += [('/late', 10 + late_ns, text_message('z'))]
        topics = [string_topic(topic) for topic in ('/a', '/same', '/rosout', '/late')]
        if name == 'first':
            topics += [string_topic('/alone')]
        write_bag(folder / name, messages, topics=topics)
    return str(folder / 'first'), str(folder / 'second')


@pytest.mark.parametrize(
    ('words', 'different'),
    [
        ('', {'/a', '/late', '/alone'}),
        ('--ignore-times', {'/a', '/alone'}),
        ('--topics /same', set()),
        ('--topics same /late', {'/late'}),
        ('--topics /alone', {'/alone'}),
        ('--ignore-times --exclude ^/a$ --exclude ^/alone$', {'/rosout'}),
        ('--ignore-times --exclude ^/a --exclude rosout', set()),
    ],
)
def test_bags_are_compared_by_the_topics_that_are_selected(
    words: str, different: set[str], tmp_path: Path, capsys: Capture
) -> None:
    status = main(['bag', 'compare', *two_bags(tmp_path), *words.split()])
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if ' /' in line]
    found = {row[1] for row in rows if row[0] == '│' and row[-2] != 'same'}
    assert (found, status) == (different, 1 if different else 0)


def test_a_topic_that_neither_bag_has_is_refused(tmp_path: Path, capsys: Capture) -> None:
    first, second = two_bags(tmp_path)
    assert main(['bag', 'compare', first, second, '--topics', '/same', '/none']) == 2
    assert f'{first}: has no topic /none, nor has {second}' in capsys.readouterr().err
