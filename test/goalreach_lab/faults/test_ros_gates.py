"""The effects of a gate on messages."""

import struct

import numpy as np
import pytest

from goalreach_lab.faults.ros_gates import Gate, shift_stamp


def message(sec: int, nanosec: int = 0, body: bytes = b'body') -> bytes:
    """Return a message that begins with a stamp, little-endian CDR."""
    return b'\0\1\0\0' + struct.pack('<iI', sec, nanosec) + body


@pytest.fixture
def gate() -> Gate:
    """Return an open gate."""
    return Gate(np.random.default_rng(0))


def test_an_open_gate_lets_everything_pass(gate: Gate) -> None:
    assert gate.arrive(b'a', 1.0) == [(1.0, b'a')]


def test_late_messages_are_due_later(gate: Gate) -> None:
    gate.set('late', 0.5)
    assert gate.arrive(b'a', 1.0) == [(1.5, b'a')]


def test_a_share_is_lost(gate: Gate) -> None:
    gate.set('lost', 0.8)
    passed = sum(len(gate.arrive(b'a', 0.0)) for _ in range(1000))
    assert 150 < passed < 250
    gate.set('lost', 1.0)
    assert not any(gate.arrive(b'a', 0.0) for _ in range(100))


def test_messages_come_twice(gate: Gate) -> None:
    gate.set('twice', 0.0)
    assert [data for _, data in gate.arrive(b'a', 0.0)] == [b'a', b'a']


def test_a_drifting_clock_is_right_at_first(gate: Gate) -> None:
    gate.set('drift', -0.25)
    passed = [gate.arrive(message(10), now_s)[0][1] for now_s in (100.0, 101.0, 103.0)]
    assert passed == [message(10), message(9, 750_000_000), message(9, 250_000_000)]


def test_a_covered_camera_sends_black_images_of_the_same_size(gate: Gate) -> None:
    gate.set('cover', 0.0)
    [(_, covered)] = gate.arrive(message(10, body=b'\7' * 640), 1.0)
    assert covered[:12] == message(10, body=b'')
    assert covered[100:] == bytes(12 + 640 - 100)


def test_neighbours_change_places(gate: Gate) -> None:
    gate.set('order', 0.0)
    passed = [data for name in (b'a', b'b', b'c', b'd') for _, data in gate.arrive(name, 0.0)]
    assert passed == [b'b', b'a', b'd', b'c']


@pytest.mark.parametrize(
    ('shift_s', 'expected'), [(-1.5, (8, 750_000_000)), (5.0, (15, 250_000_000)), (-99.0, (0, 0))]
)
def test_stamps_are_shifted_and_nothing_else(shift_s: float, expected: tuple[int, int]) -> None:
    assert shift_stamp(message(10, 250_000_000), shift_s) == message(*expected)
