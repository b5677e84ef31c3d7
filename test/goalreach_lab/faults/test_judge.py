"""What is held against a stack, on sequences worked out by hand."""

import pytest

from goalreach_lab.faults.document import fault_document, summarise_kinds
from goalreach_lab.faults.judge import Record, Verdict
from goalreach_lab.faults.kinds import KINDS, choose_kinds
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Confidence, Odometry, Pose2, RegionState, Twist2

TICK_NS = 40_000_000


def truth(y_m: float) -> Odometry:
    pose = Pose2(x_m=1.5, y_m=y_m, heading_rad=0.0)
    return Odometry(pose=pose, twist=Twist2(linear_m_per_s=0.5, steering_rad_per_s=0.0))


def state(y_m: float, confidence: Confidence = Confidence.OK) -> RegionState:
    return RegionState(
        region=(1, 1),
        mu_x=(0.0, 1.0, 0.0),
        mu_y=(0.0, 1.0, 0.0),
        pose=Pose2(x_m=1.5, y_m=y_m, heading_rad=0.0),
        goal_probability=0.0,
        confidence=confidence,
    )


def drive(record: Record, first: int, count: int, *, error_m: float = 0.0) -> None:
    """Let ticks pass in which all is as it should be, but for the error of the pose."""
    for tick in range(first, first + count):
        record.truth(tick * TICK_NS, truth(2.0), wall_s=0.04 * tick)
        record.state(tick * TICK_NS, state(2.0 + error_m))
        record.command(tick * TICK_NS, Twist2(linear_m_per_s=0.5, steering_rad_per_s=0.0))


def test_sound_driving_is_seen_from_its_first_tick() -> None:
    record = Record(Arena())
    drive(record, 1, 9)
    assert record.healthy_since is None
    drive(record, 10, 5)
    assert record.healthy_since == (2 * TICK_NS, 0.08)  # the first tick had no command before it


def test_a_chain_that_has_broken_is_not_sound() -> None:
    record = Record(Arena())
    drive(record, 1, 20)
    record.end()
    for tick in range(21, 60):
        record.truth(tick * TICK_NS, truth(2.0), wall_s=0.04 * tick)
    assert record.healthy_since is None


def test_a_pose_is_wrong_beyond_six_inches_and_only_where_it_is_believed() -> None:
    record = Record(Arena())
    record.truth(TICK_NS, truth(2.0), wall_s=0.04)
    record.state(TICK_NS, state(2.15))
    assert record.wrong == 0
    assert record.worst_m == pytest.approx(0.15)
    record.state(TICK_NS, state(2.16, Confidence.UNCERTAIN))
    assert record.wrong == 0
    record.state(TICK_NS, state(2.16))
    assert record.wrong == 1


def test_a_wall_that_is_touched_once_is_one_bump() -> None:
    record = Record(Arena())
    for tick, y_m in enumerate([0.3, 0.225, 0.225, 0.3, 0.225], start=1):
        record.truth(tick * TICK_NS, truth(y_m), wall_s=0.04 * tick)
    assert record.bumps == 2


def test_recovery_counts_from_the_end_of_the_fault() -> None:
    record = Record(Arena())
    drive(record, 1, 20)
    record.begin()
    record.lines.append('landmark_localizer: error: was ended by SIGKILL')
    record.end()
    drive(record, 46, 12)
    verdict = record.verdict(
        'k',
        'SIGKILL',
        began_ns=20 * TICK_NS,
        ended=(20 * TICK_NS, 0.8),
        sound=(47 * TICK_NS, 1.88),
    )
    assert verdict.recovery_s == pytest.approx(27 * 0.04)
    assert not verdict.path_ended
    assert verdict.report.startswith('landmark_localizer')


def test_recovery_takes_as_long_by_the_wall_while_the_clock_of_the_graph_stands() -> None:
    record = Record(Arena())
    ended, sound = (20 * TICK_NS, 10.0), (25 * TICK_NS, 11.5)
    verdict = record.verdict('k', 'x', began_ns=0, ended=ended, sound=sound)
    assert verdict.recovery_s == pytest.approx(1.5)
    verdict = record.verdict('k', 'x', began_ns=0, ended=ended, sound=sound, speed=2.0)
    assert verdict.recovery_s == pytest.approx(3.0)


def two_verdicts(kind: str) -> list[Verdict]:
    """Return what came of a fault without and with the end of a path in it."""
    return [
        Verdict(
            kind=kind, bumps=0, wrong=0, worst_m=0.01, recovery_s=taken_s, report='r',
            moment_s=1.0, path_ended=ended,
        )
        for taken_s, ended in ((1.0, False), (9.0, True))
    ]  # fmt: skip


@pytest.mark.parametrize(
    ('kind', 'p95_s'), [('/odom lost', 1.0), ('a bumper stuck', 9.0), ('clock stalled', 1.0)]
)
def test_the_search_after_a_path_is_no_recovery_unless_one_had_to_end(
    kind: str, p95_s: float
) -> None:
    (one,) = summarise_kinds(two_verdicts(kind))
    assert (one.injected, one.hangs, one.recovery_p95_s) == (2, 0, p95_s)


def test_the_table_counts_what_came_of_each_kind() -> None:
    kind = KINDS[0]
    good = Verdict(
        kind=kind.name, bumps=0, wrong=0, worst_m=0.01, recovery_s=1.0, report='r', moment_s=1.0
    )
    bad = Verdict(
        kind=kind.name, bumps=1, wrong=3, worst_m=0.3, recovery_s=None, report='', moment_s=2.0
    )
    (one,) = summarise_kinds([good, bad])
    assert (one.injected, one.bumps, one.wrong, one.hangs, one.named) == (2, 1, 1, 1, 1)
    assert f'| {kind.name} |' in fault_document([one], 'command')


def test_there_are_enough_kinds_each_with_its_own_name() -> None:
    assert len({kind.name for kind in KINDS}) == len(KINDS) >= 25


def test_kinds_are_chosen_by_a_word() -> None:
    assert [kind.name for kind in choose_kinds('camera frozen')] == ['camera frozen']
    assert choose_kinds('') == KINDS
    with pytest.raises(ConfigurationError, match='--kinds'):
        choose_kinds('earthquake')


def test_the_clock_at_a_moment_is_the_tick_sent_last_even_of_a_stack_that_began_anew() -> None:
    record = Record(Arena())
    record.sent_ns.update({40: 1000, 80: 1100, 120: 1200})
    assert [record.clock_at(wall_ns) for wall_ns in (999, 1000, 1150, 5000)] == [0, 40, 80, 120]
    record.sent_ns.update({40: 2000, 80: 2100})
    assert [record.clock_at(wall_ns) for wall_ns in (1999, 2050, 2100)] == [120, 40, 80]
