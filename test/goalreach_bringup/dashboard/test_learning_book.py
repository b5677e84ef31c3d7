from goalreach_bringup.dashboard.learning_book import LearningBook
from goalreach_msgs_py.values import PathOutcome, Transition


def ended(outcome: PathOutcome | None, trial: int = 0) -> Transition:
    return Transition(
        state=(1, 2),
        action=6,
        reward=0.0,
        next_state=(1, 1),
        temperature=0.1,
        trial=trial,
        path=0,
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
    assert (book.trials[0].paths, book.trials[0].goals) == (5, 2)


def test_the_book_is_bounded() -> None:
    book = LearningBook()
    for trial in range(5000):
        book.add(ended(PathOutcome.GOAL, trial), in_goal=True)
    assert len(book.trials) == 400
    assert min(book.trials) == 4600
    assert book.paths == 5000
