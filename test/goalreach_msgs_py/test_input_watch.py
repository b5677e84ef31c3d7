"""What is told of a node's inputs."""

from goalreach_msgs_py.input_watch import InputWatch
from goalreach_msgs_py.synchronizer import StampSynchronizer

S = 1_000_000_000


def told(watch: InputWatch, topic: str, stamp_ns: int, now_s: float) -> str:
    """Return the kind and text of the trouble of one message."""
    trouble = watch.heard(topic, stamp_ns, now_s)
    return '' if trouble is None else f'{trouble.kind}: {trouble.text}'


def test_sound_inputs_are_not_worth_a_word() -> None:
    watch = InputWatch(['a', 'b'])
    for tick in range(50):
        now_s = tick * 0.04
        assert not told(watch, 'a', tick * S // 25, now_s)
        assert not told(watch, 'b', tick * S // 25, now_s + 0.01)
        assert not watch.look(now_s + 0.02)


def test_a_silent_input_is_told_while_another_goes_on() -> None:
    watch = InputWatch(['a', 'b'])
    watch.heard('a', 0, 0.0)
    for tick in range(8):
        watch.heard('b', tick * S // 5, tick * 0.2)
        troubles = watch.look(tick * 0.2)
    assert [(t.topic, t.kind, t.text) for t in troubles] == [('a', 'silent', 'nothing for 1.4 s')]


def test_when_all_are_silent_nothing_is_told() -> None:
    watch = InputWatch(['a', 'b'])
    watch.heard('a', 0, 0.0)
    watch.heard('b', 0, 0.0)
    assert [watch.look(tick * 0.2) for tick in range(20)] == [[]] * 20


def test_stamps_that_do_not_belong_together_are_told() -> None:
    watch = InputWatch(['a', 'b'])
    watch.heard('a', 10 * S, 0.0)
    watch.heard('b', 10 * S, 0.0)
    assert told(watch, 'a', 15 * S, 0.05) == 'apart: 5.00 s ahead of b'
    watch.heard('a', 10 * S, 0.1)
    assert told(watch, 'a', 5 * S, 0.15) == 'apart: 5.00 s behind b'


def test_what_comes_twice_or_out_of_order_is_told_as_harmless() -> None:
    watch = InputWatch(['a'])
    watch.heard('a', 10 * S, 0.0)
    assert told(watch, 'a', 10 * S, 0.1) == 'twice: a message came twice'
    assert told(watch, 'a', 9 * S + S // 2, 0.2) == 'order: out of order: 0.50 s before the last'
    trouble = watch.heard('a', 9 * S, 0.3)
    assert trouble is not None
    assert trouble.is_harmless


def test_a_node_that_was_held_up_tells_that_of_itself_alone() -> None:
    watch = InputWatch(['a', 'b'])
    watch.heard('a', 0, 0.0)
    watch.heard('b', 0, 0.0)
    watch.look(0.1)
    watch.heard('b', S, 1.6)
    troubles = watch.look(1.6)
    assert [(t.topic, t.kind, t.text) for t in troubles] == [
        ('', 'held', 'was held up for 1.50 s')
    ]
    assert not watch.look(1.8)


def test_what_a_synchronizer_misses_is_told_by_name() -> None:
    join = StampSynchronizer(['a', 'b'])
    watch = InputWatch(['a', 'b'])
    for tick in range(10):
        join.add('a', tick, 'A')
        watch.heard('a', tick, tick * 0.04)
        if tick % 5 == 0:
            join.add('b', tick, 'B')
            watch.heard('b', tick, tick * 0.04)
    assert join.missing == {'a': 0, 'b': 4}
    assert [t.text for t in watch.look(0.4, join.missing)] == ['4 messages were missing']
    assert not watch.look(0.5, join.missing)


def test_stamps_from_the_future_do_not_block_a_synchronizer() -> None:
    join = StampSynchronizer(['a', 'b'], depth=4)
    for tick in range(20):
        join.add('a', 1000 + tick, 'A')
    for tick in range(20):
        join.add('a', tick, 'A')
        assert join.add('b', tick, 'B') is not None
