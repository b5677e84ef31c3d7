from goalreach_dashboard.state import LearningBook
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
    book = LearningBook()
    book.add(ended(None), in_goal=False)
    book.add(ended(PathOutcome.GOAL), in_goal=True)
    book.add(ended(PathOutcome.GOAL), in_goal=None)
    book.add(ended(PathOutcome.GOAL), in_goal=False)
    book.add(ended(PathOutcome.BUMP), in_goal=False)
    book.add(ended(PathOutcome.TIMEOUT), in_goal=False)
    counted = (book.paths, book.goals, book.false_goals, book.bumps, book.timeouts)
    assert counted == (5, 2, 1, 1, 1)
    assert book.curve[-1] == (1, 2 / 5)


def test_success_is_told_of_the_last_22_paths() -> None:
    book = LearningBook()
    for path in range(22):
        book.add(ended(PathOutcome.BUMP, path), in_goal=False)
    for path in range(22, 33):
        book.add(ended(PathOutcome.GOAL, path), in_goal=True)
    assert book.curve[21][1] == 0.0
    assert book.curve[-1][1] == 0.5


def test_the_curve_never_goes_back() -> None:
    book = LearningBook()
    for path in (0, 1, 2, 1, 2, 3):
        book.add(ended(PathOutcome.GOAL, path), in_goal=True)
    assert [number for number, _ in book.curve] == [1, 2, 3, 4]
    assert book.paths == 6


def test_the_book_is_bounded() -> None:
    book = LearningBook()
    for path in range(20_000):
        book.add(ended(PathOutcome.GOAL, path), in_goal=True)
    assert 250 <= len(book.curve) <= 600
    assert book.paths == 20_000
