"""Splitting ticks into paths and evaluating them."""

from collections.abc import Sequence
import itertools

import pytest

from goalreach_bringup.launch.path_evaluator import PathEvaluator
from goalreach_evaluation.path_metrics import PathResult, Tick
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import PathOutcome, Pose2

REGIONS = RegionMap()
START = Pose2(x_m=0.5, y_m=3.0, heading_rad=0.0)


def tick(stamp: int, x: float, y: float) -> Tick:
    truth = Pose2(x_m=x, y_m=y, heading_rad=0.0)
    return Tick(time_ns=stamp, truth=truth, estimate=truth, commanded_heading_rad=0.0)


def judged(results: Sequence[PathResult | None]) -> list[PathResult]:
    assert None not in results
    return [result for result in results if result is not None]


@pytest.mark.parametrize('outcome_first', [False, True])
def test_a_path_ends_with_the_tick_of_its_outcome(outcome_first: bool) -> None:  # noqa: FBT001
    evaluator = PathEvaluator([START], REGIONS)
    results = []
    ticks = [tick(0, 9.0, 9.0), tick(1, 0.5, 3.0), tick(2, 1.5, 3.0), tick(3, 1.7, 0.5)]
    if outcome_first:
        results += judged(evaluator.add_outcome(3, 0, PathOutcome.GOAL))
    for each in ticks:
        results += judged(evaluator.add_tick(each))
    if not outcome_first:
        results += judged(evaluator.add_outcome(3, 0, PathOutcome.GOAL))
    (result,) = results
    assert result.outcome == 'goal'
    assert result.length_m == pytest.approx(1.0 + (0.2**2 + 2.5**2) ** 0.5)
    assert result.duration_s == pytest.approx(2e-9)


def test_a_goal_outside_the_goal_region_is_false() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    for each in (tick(1, 0.5, 3.0), tick(2, 0.5, 0.5)):
        assert not evaluator.add_tick(each)
    (result,) = judged(evaluator.add_outcome(2, 0, PathOutcome.GOAL))
    assert result.outcome == 'false-goal'


def test_ticks_between_the_end_and_the_next_placing_belong_to_no_path() -> None:
    other = Pose2(x_m=3.0, y_m=4.0, heading_rad=0.0)
    evaluator = PathEvaluator([START, other], REGIONS)
    ticks = [
        tick(1, 0.5, 3.0),
        tick(2, 0.6, 3.0),
        tick(3, 0.7, 3.0),
        tick(4, 3.0, 4.0),
        tick(5, 3.0, 3.9),
    ]
    outcomes = {2: (0, PathOutcome.BUMP), 5: (1, PathOutcome.TIMEOUT)}
    results = []
    for each in ticks:
        results += judged(evaluator.add_tick(each))
        if each.time_ns in outcomes:
            results += judged(evaluator.add_outcome(each.time_ns, *outcomes[each.time_ns]))
    assert [r.outcome for r in results] == ['bump', 'timeout']
    assert [r.length_m for r in results] == pytest.approx([0.1, 0.1])
    assert results[1].start == other


def of_kind(events: Sequence[tuple[str, int]], kind: str) -> list[tuple[str, int]]:
    return [event for event in events if event[0] == kind]


def test_it_does_not_matter_when_an_outcome_arrives() -> None:
    events = [('tick', 1), ('tick', 2), ('outcome', 2), ('tick', 3), ('tick', 4), ('outcome', 4)]
    lengths = set()
    for order in itertools.permutations(events):
        if any(of_kind(order, kind) != of_kind(events, kind) for kind in ('tick', 'outcome')):
            continue  # the ticks of a synchronizer come in order, and so do those of one sender
        evaluator = PathEvaluator([], REGIONS)
        results = []
        for kind, stamp in order:
            if kind == 'tick':
                results += judged(evaluator.add_tick(tick(stamp, 0.5, 1.0 + 0.1 * stamp)))
            else:
                results += judged(evaluator.add_outcome(stamp, stamp // 2 - 1, PathOutcome.BUMP))
        lengths.add(tuple(round(r.length_m, 9) for r in results))
    assert lengths == {(0.1, 0.1)}


def test_a_lost_last_tick_is_made_up_for_by_the_next() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    for each in (tick(1, 0.5, 3.0), tick(2, 1.7, 0.5)):
        assert not evaluator.add_tick(each)
    assert not evaluator.add_outcome(3, 0, PathOutcome.GOAL)
    (result,) = judged(evaluator.add_tick(tick(4, 0.5, 3.0)))
    assert result.outcome == 'goal'
    assert not evaluator.evaluate_pending()


def test_silence_settles_what_waits_for_a_tick() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    for each in (tick(1, 0.5, 3.0), tick(2, 1.7, 0.5)):
        assert not evaluator.add_tick(each)
    assert not evaluator.add_outcome(3, 0, PathOutcome.BUMP)
    (result,) = judged(evaluator.evaluate_pending())
    assert result.outcome == 'bump'
    assert evaluator.evaluate_pending() == []


def test_a_path_of_which_only_the_end_was_heard_counts() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    assert not evaluator.add_tick(tick(5, 1.7, 0.5))
    (result,) = judged(evaluator.add_outcome(5, 0, PathOutcome.TIMEOUT))
    assert (result.outcome, result.length_m) == ('timeout', 0.0)


def test_a_path_begins_where_the_robot_was_nearest_to_a_start_that_it_has_not_met() -> None:
    evaluator = PathEvaluator([START], REGIONS, judged=False)
    for stamp, x_m in enumerate((1.7, 0.52, 0.515, 0.615, 0.515), 1):  # the second is on its way
        assert not evaluator.add_tick(tick(stamp, x_m, 3.0))
    (result,) = judged(evaluator.add_outcome(5, 0, PathOutcome.GOAL))
    assert (result.start, result.outcome) == (START, 'declared')
    assert result.length_m == pytest.approx(0.2)
    assert result.duration_s == pytest.approx(2e-9)


def test_a_path_whose_end_was_not_heard_is_counted_and_the_next_is_judged() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    ticks = [tick(1, 0.5, 3.0), tick(2, 1.0, 3.0), tick(3, 0.5, 3.0), tick(4, 0.5, 2.9)]
    for each in ticks:
        assert not evaluator.add_tick(each)
    skipped, *others = evaluator.add_outcome(4, 1, PathOutcome.BUMP)
    assert skipped is None
    (result,) = judged(others)
    assert result.outcome == 'bump'
    assert result.length_m == pytest.approx(0.1)
    assert result.duration_s == pytest.approx(1e-9)
    assert (evaluator.path, evaluator.evaluate_pending()) == (2, [])


def test_a_path_of_which_no_tick_was_heard_is_counted() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    assert not evaluator.add_outcome(3, 0, PathOutcome.GOAL)
    assert evaluator.evaluate_pending() == [None]
    assert evaluator.path == 1


def test_an_outcome_that_comes_twice_counts_once() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    assert not evaluator.add_tick(tick(1, 0.5, 3.0))
    assert len(evaluator.add_outcome(1, 0, PathOutcome.BUMP)) == 1
    assert not evaluator.add_outcome(1, 0, PathOutcome.BUMP)
    assert not evaluator.evaluate_pending()


@pytest.mark.parametrize(('x_m', 'y_m'), [(0.5, 3.0), (1.7, 3.0), (3.0, 0.5)])
def test_a_goal_in_any_other_region_is_false(x_m: float, y_m: float) -> None:
    evaluator = PathEvaluator([START], REGIONS)
    assert not evaluator.add_tick(tick(1, x_m, y_m))
    (result,) = judged(evaluator.add_outcome(1, 0, PathOutcome.GOAL))
    assert result.outcome == 'false-goal'


def test_a_path_begins_where_a_person_has_put_the_robot() -> None:
    evaluator = PathEvaluator([], REGIONS)
    carried = [(1.6, 3.6), (1.1, 3.1), (1.0, 3.0), (0.9, 2.9)]
    for stamp, (x_m, y_m) in enumerate(carried, 1):
        assert not evaluator.add_tick(tick(stamp, x_m, y_m))
    (result,) = judged(evaluator.add_outcome(4, 0, PathOutcome.BUMP))
    assert result.start == Pose2(x_m=1.1, y_m=3.1, heading_rad=0.0)
    assert result.length_m == pytest.approx(2 * 0.02**0.5)


def test_where_the_robot_is_placed_a_jump_is_part_of_its_path() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    for each in (tick(1, 1.0, 3.0), tick(2, 0.5, 3.0), tick(3, 0.5, 2.5), tick(4, 0.5, 2.4)):
        assert not evaluator.add_tick(each)
    _, *others = evaluator.add_outcome(4, 1, PathOutcome.BUMP)
    (result,) = judged(others)
    assert result.length_m == pytest.approx(0.6)


def test_each_path_that_was_not_heard_is_counted_and_starts_repeat() -> None:
    other = Pose2(x_m=0.5, y_m=1.5, heading_rad=0.0)
    evaluator = PathEvaluator([START, other], REGIONS, path=3)
    for each in (tick(1, 0.5, 3.0), tick(2, 0.5, 1.5), tick(3, 0.5, 1.4)):
        assert not evaluator.add_tick(each)
    *skipped, result = evaluator.add_outcome(3, 5, PathOutcome.BUMP)
    assert skipped == [None, None]
    assert result is not None
    assert result.start == other
    assert result.length_m == pytest.approx(0.1)
    assert evaluator.path == 6


def test_a_repeated_tick_or_one_of_before_is_ignored() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    assert PathEvaluator([START], REGIONS).last == (0, None)
    assert not evaluator.add_tick(tick(2, 0.5, 3.0))
    assert evaluator.has_begun
    evaluator.begin_path()
    for stamp in (1, 2):
        assert not evaluator.add_tick(tick(stamp, 0.6, 3.0))
        assert not evaluator.has_begun
    assert evaluator.last == (2, START)


def test_a_restarted_clock_counts_from_its_new_stamps() -> None:
    evaluator = PathEvaluator([START], REGIONS)
    assert not evaluator.add_tick(tick(9, 0.5, 3.0))
    assert not evaluator.add_outcome(10, 0, PathOutcome.BUMP)
    evaluator.restart_clock()
    assert (evaluator.has_begun, evaluator.last) == (False, (0, START))
    assert not evaluator.add_tick(tick(1, 0.5, 3.0))
    (result,) = judged(evaluator.add_outcome(1, 0, PathOutcome.TIMEOUT))
    assert (result.outcome, result.duration_s) == ('timeout', 0.0)
