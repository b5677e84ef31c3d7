"""The number of lost messages is true."""

from hypothesis import given, settings
from hypothesis import strategies as st

from goalreach_bags.tick_order import SequenceCount


def lost(numbers: list[int], publishers: int = 1) -> int:
    count = SequenceCount()
    for number in numbers:
        count.add(number, publishers)
    return count.lost


def test_gaps_are_counted() -> None:
    assert lost([1, 2, 3]) == 0
    assert lost([1, 2, 5, 6, 10]) == 5


def test_what_was_published_before_the_first_is_not_lost() -> None:
    assert lost([40, 41, 43]) == 1


def test_publishers_that_take_turns_lose_nothing() -> None:
    assert lost([1, 1, 2, 2, 3, 4, 3, 5, 4], publishers=2) == 0


@given(st.lists(st.booleans(), min_size=1, max_size=60))
def test_one_publisher_is_exact(arrives: list[bool]) -> None:
    numbers = [k + 1 for k, there in enumerate(arrives) if there]

    expected = numbers[-1] - numbers[0] + 1 - len(numbers) if numbers else 0
    assert lost(numbers) == expected


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 2), min_size=1, max_size=60))
def test_several_publishers_in_any_order_lose_nothing(order: list[int]) -> None:
    sent = [0, 0, 0]
    numbers = []
    for publisher in order:
        sent[publisher] += 1
        numbers.append(sent[publisher])

    assert lost(numbers, publishers=3) == 0
