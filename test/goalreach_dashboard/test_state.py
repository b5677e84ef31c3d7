from goalreach_dashboard.state import PageState, PathStatistics
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import PathOutcome, Transition


def ended(outcome: PathOutcome | None, path: int = 0) -> Transition:
    return Transition(
        state=(1, 2),
        action=6,
        reward=0.0,
        next_state=(1, 1),
        temperature=0.1,
        trial=0,
        path=path,
        outcome=outcome,
    )


def test_outcomes_are_counted_and_goals_judged_by_the_truth() -> None:
    paths = PathStatistics()
    paths.add(ended(None), in_goal=False)
    paths.add(ended(PathOutcome.GOAL), in_goal=True)
    paths.add(ended(PathOutcome.GOAL), in_goal=None)
    paths.add(ended(PathOutcome.GOAL), in_goal=False)
    paths.add(ended(PathOutcome.BUMP), in_goal=False)
    paths.add(ended(PathOutcome.TIMEOUT), in_goal=False)
    assert paths.outcomes == {'goal': 2, 'false-goal': 1, 'bump': 1, 'timeout': 1}
    assert paths.curve[-1] == (1, 2 / 5)


def test_success_is_averaged_over_the_last_22_paths() -> None:
    paths = PathStatistics()
    for path in range(22):
        paths.add(ended(PathOutcome.BUMP, path), in_goal=False)
    for path in range(22, 33):
        paths.add(ended(PathOutcome.GOAL, path), in_goal=True)
    assert paths.curve[21][1] == 0.0
    assert paths.curve[-1][1] == 0.5


def test_the_curve_never_goes_back() -> None:
    paths = PathStatistics()
    for path in (0, 1, 2, 1, 2, 3):
        paths.add(ended(PathOutcome.GOAL, path), in_goal=True)
    assert [number for number, _ in paths.curve] == [1, 2, 3, 4]
    assert paths.outcomes.total() == 6


def test_the_curve_is_bounded() -> None:
    paths = PathStatistics()
    for path in range(20_000):
        paths.add(ended(PathOutcome.GOAL, path), in_goal=True)
    assert 250 <= len(paths.curve) <= 600
    assert paths.outcomes.total() == 20_000


def test_the_first_event_and_the_last_are_kept() -> None:
    page = PageState(arena=Arena())
    page.add_event({'event': 'begin'})
    for number in range(1200):
        page.add_event({'event': 'record', 'on': True, 'bag': f'bag_{number}'})
    events = list(page.events.values())
    assert len(events) == 1000
    assert events[0] == {'event': 'begin'}
    assert (events[1]['bag'], events[-1]['bag']) == ('bag_201', 'bag_1199')
