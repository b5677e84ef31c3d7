import pytest

from goalreach_dashboard.state import PageState, PathStatistics
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import PathOutcome, Pose2, Transition

GOAL = Pose2(x_m=1.778, y_m=0.5, heading_rad=0.0)
ELSEWHERE = Pose2(x_m=0.5, y_m=4.0, heading_rad=0.0)


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


@pytest.mark.parametrize(
    ('outcome', 'truth', 'counted'),
    [
        (None, GOAL, {}),
        (PathOutcome.GOAL, GOAL, {'goal': 1}),
        (PathOutcome.GOAL, None, {'goal': 1}),
        (PathOutcome.GOAL, ELSEWHERE, {'false-goal': 1}),
        (PathOutcome.BUMP, ELSEWHERE, {'bump': 1}),
        (PathOutcome.TIMEOUT, GOAL, {'timeout': 1}),
    ],
)
def test_outcomes_are_counted_and_goals_judged_by_the_truth(
    outcome: PathOutcome | None, truth: Pose2 | None, counted: dict[str, int]
) -> None:
    page = PageState(arena=Arena())
    if truth is not None:
        page.poses.add_truth(7, truth)
    page.add_transition(7, ended(outcome))
    assert page.paths.outcomes == counted
    assert [event['outcome'] for event in page.events.values()] == [*counted]
    assert page.paths.last == ended(outcome)


def test_in_a_run_the_outcomes_are_those_of_the_launcher() -> None:
    """It knows the truth that the page was not subscribed to, or says that nobody knows it."""
    page = PageState(arena=Arena())
    page.add_event({'event': 'begin'})
    for outcome in ('goal', 'false-goal', 'declared'):
        page.add_transition(7, ended(PathOutcome.GOAL))
        page.add_event({'event': 'path', 'outcome': outcome})
    assert page.paths.outcomes == {'goal': 1, 'false-goal': 1, 'declared': 1}
    assert page.paths.curve == [(1, 1.0), (2, 1 / 2), (3, 1 / 3)]
    assert page.paths.last == ended(PathOutcome.GOAL)


def test_success_is_averaged_over_the_last_22_paths() -> None:
    paths = PathStatistics()
    for path in range(22):
        paths.add(path + 1, 'bump')
    for path in range(22, 33):
        paths.add(path + 1, 'goal')
    assert paths.curve[21][1] == 0.0
    assert paths.curve[-1][1] == 0.5


def test_the_curve_never_goes_back() -> None:
    paths = PathStatistics()
    for number in (1, 2, 3, 2, 3, 4):
        paths.add(number, 'goal')
    assert [number for number, _ in paths.curve] == [1, 2, 3, 4]
    assert paths.outcomes.total() == 6


def test_the_curve_is_bounded() -> None:
    paths = PathStatistics()
    for path in range(20_000):
        paths.add(path + 1, 'goal')
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
