"""Messages of lockstep in the order of its time."""

from hypothesis import given
from hypothesis import strategies as st

from goalreach_bags.tick_order import TickOrder

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


def test_what_came_before_the_first_tick_gets_its_time() -> None:
    order = TickOrder(['/image', '/pose'])

    found = taken(order, [('/markers', None, b'm'), *tick(40)])

    assert found == [
        ('/extra', 40, b'40'),
        ('/image', 40, b'40'),
        ('/markers', 40, b'm'),
        ('/pose', 40, b'40'),
    ]


def test_repetitions_are_dropped() -> None:
    order = TickOrder(['/image', '/pose'])

    found = taken(order, [*tick(40), *tick(40), *tick(80)])

    assert len(found) == 6
    assert order.repeats == 3


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
