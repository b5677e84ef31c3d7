"""Messages of a lockstep run in the order of its time, and the number of lost ones."""

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from goalreach_bags.tick_order import SequenceCount, TickOrder

Given = tuple[str, int | None, bytes]


def taken(order: TickOrder, messages: list[Given]) -> list[tuple[str, int, bytes]]:
    out = []
    for topic, stamp_ns, data in messages:
        order.add(topic, stamp_ns, data)
        if order.complete:
            out += list(order.settled())
    out += list(order.rest())
    return [(m.topic, m.time_ns, m.data) for m in out]


def tick(stamp_ns: int) -> list[Given]:
    mark = b'%d' % stamp_ns
    return [('/image', stamp_ns, mark), ('/pose', stamp_ns, mark), ('/extra', stamp_ns, mark)]


def test_tick_is_complete_when_all_required_is_there() -> None:
    order = TickOrder(['/image', '/pose'])

    assert not order.complete
    order.add('/image', 5, b'a')
    assert (order.stamp_ns, order.complete) == (5, False)
    order.add('/extra', 5, b'b')
    order.add('/pose', 5, b'c')
    assert order.complete


def test_what_several_publishers_repeat_on_one_topic_is_taken_once() -> None:
    order = TickOrder(['/image', '/pose'])
    status: list[Given] = [('/status', 40, b'one'), ('/status', 40, b'other')]

    found = taken(order, [*status, *tick(40), *status, *tick(40), ('/status', 80, b'next')])

    assert [data for topic, _, data in found if topic == '/status'] == [b'one', b'other', b'next']


def test_what_came_before_the_first_tick_gets_its_time() -> None:
    order = TickOrder(['/image', '/pose'])

    found = taken(order, [('/markers', None, b'm'), *tick(40)])

    assert found == [
        ('/extra', 40, b'40'),
        ('/image', 40, b'40'),
        ('/markers', 40, b'm'),
        ('/pose', 40, b'40'),
    ]


def test_without_a_tick_all_is_at_zero() -> None:
    assert taken(TickOrder(['/image']), [('/markers', None, b'm')]) == [('/markers', 0, b'm')]


@pytest.mark.parametrize(
    ('topics', 'ticks', 'settled'),
    [
        (('/image', '/pose'), 2, 0),  # two are held back
        (('/image', '/pose'), 3, 1),
        (('/image', '/pose'), 6, 4),
        (('/image',), 64, 0),  # the pose may still come
        (('/image',), 65, 63),
    ],
)
def test_ticks_settle_once_nothing_of_them_can_come(
    topics: tuple[str, ...], ticks: int, settled: int
) -> None:
    order = TickOrder(['/image', '/pose'])
    for stamp_ns in range(1, ticks + 1):
        for topic in topics:
            order.add(topic, stamp_ns, b'%d' % stamp_ns)
    expected = [(topic, stamp_ns) for stamp_ns in range(1, settled + 1) for topic in topics]
    assert [(m.topic, m.time_ns) for m in order.settled()] == expected
    assert list(order.settled()) == []
    order.add('/image', 0, b'late')
    assert list(order.settled()) == []
    assert order.complete == ('/pose' in topics)
    assert [(m.topic, m.time_ns) for m in order.rest()] == [
        ('/image', 0),
        *((topic, ns) for ns in range(settled + 1, ticks + 1) for topic in topics),
    ]


def test_repetitions_are_dropped() -> None:
    order = TickOrder(['/image', '/pose'])

    found = taken(order, [*tick(40), *tick(40), *tick(80)])

    assert len(found) == 6
    assert taken(order, tick(80)) == []


def test_without_a_stamp_only_nodes_of_the_run_repeat_themselves() -> None:
    """Another node may say the same in every tick."""
    order = TickOrder(['/image', '/pose'], ['/markers'])
    said: list[Given] = [('/markers', None, b'm'), ('/stop', None, b'no')]

    found = taken(order, [*tick(40), *said, *tick(80), *said, *tick(120), *said])

    assert [time_ns for topic, time_ns, _ in found if topic == '/markers'] == [40]
    assert [time_ns for topic, time_ns, _ in found if topic == '/stop'] == [40, 80, 120]


def test_several_messages_of_one_topic_and_stamp_have_one_order() -> None:
    statuses: list[Given] = [('/diagnostics', 40, data) for data in (b'z', b'a', b'm')]

    orders = [taken(TickOrder(['/image']), [*tick(40), *s]) for s in (statuses, statuses[::-1])]

    assert orders[0] == orders[1]


@given(st.randoms(use_true_random=False))
def test_order_does_not_depend_on_that_of_arrival(random: object) -> None:
    ticks = [tick(40 * (k + 1)) for k in range(6)]
    expected = taken(TickOrder(['/image', '/pose']), [m for t in ticks for m in t])
    late: list[Given] = []
    shuffled: list[Given] = []
    for messages in ticks:
        required, extra = messages[:2], messages[2]
        random.shuffle(required)  # type: ignore[attr-defined]
        shuffled += [*required, *late]
        late = [extra]
    shuffled += late

    assert taken(TickOrder(['/image', '/pose']), shuffled) == expected


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


def test_a_gap_after_a_publisher_has_gone_is_counted() -> None:
    count = SequenceCount()
    for number, publishers in ((1, 2), (1, 2), (3, 1)):
        count.add(number, publishers)
    assert count.lost == 1


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


def test_a_robot_that_lacks_a_topic_is_written_all_the_same() -> None:
    order, written = TickOrder(['/image', '/pose']), 0
    for number in range(1, 200):
        order.add('/image', 40 * number, b'%d' % number)
        written += len(list(order.settled()))
    assert not order.complete
    assert written >= 130
