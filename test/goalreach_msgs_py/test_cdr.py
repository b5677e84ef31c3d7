"""Where CDR has what: bytes worked out by hand."""

import struct

import pytest

from goalreach_msgs_py.cdr import CdrReader, CdrWriter, MessageError, stamp_of, with_stamp

STAMP = 3_000_000_007
BEGIN = bytes([0, 1, 0, 0])
STAMP_BYTES = bytes([3, 0, 0, 0, 7, 0, 0, 0])
HEADER = BEGIN + STAMP_BYTES + b'\4\0\0\0map\0'


def test_numbers_stand_at_multiples_of_their_size() -> None:
    writer = CdrWriter(STAMP, 'map')
    writer.numbers('B', 7)
    writer.numbers('d', 0.5)
    assert writer.raw() == HEADER + bytes([7]) + bytes(7) + struct.pack('<d', 0.5)


def test_alignment_counts_from_the_end_of_the_encapsulation() -> None:
    writer = CdrWriter()
    writer.numbers('I', 1)
    writer.zeros('2d')
    assert writer.raw() == BEGIN + b'\1\0\0\0' + bytes(4) + bytes(16)


def test_a_text_counts_its_zero_and_what_follows_is_aligned() -> None:
    writer = CdrWriter(STAMP, 'odom')
    writer.text('x', 'é')
    assert (
        writer.raw()[12:] == b'\5\0\0\0odom\0\0\0\0' + b'\2\0\0\0x\0\0\0' + b'\3\0\0\0\xc3\xa9\0'
    )


def test_bytes_are_appended_as_they_are() -> None:
    writer = CdrWriter()
    writer.numbers('I', 3)
    assert writer.raw(b'abc') == BEGIN + b'\3\0\0\0abc'


def _message(order: str) -> bytes:
    """Return stamp, frame, two texts, a byte, a double, three floats in a sequence, two bytes."""
    raw = bytes([0, order == '<', 0, 0]) + struct.pack(f'{order}iI', 3, 7)
    raw += struct.pack(f'{order}I4s', 4, b'map\0')
    raw += struct.pack(f'{order}I2s2xI3sB', 2, b'a\0', 3, b'bc\0', 9)
    raw += struct.pack(f'{order}d', 0.5) + struct.pack(f'{order}I3f', 3, 1.0, 2.0, 4.0)
    return raw + struct.pack(f'{order}I', 2) + b'\x10\x11'


@pytest.mark.parametrize('order', ['<', '>'])
def test_either_byte_order_is_read(order: str) -> None:
    raw = _message(order)
    reader = CdrReader(raw)
    assert reader.texts(2) == ['a', 'bc']
    assert reader.numbers('B') == (9,)
    assert reader.numbers('d') == (0.5,)
    assert reader.sequence('f') == (1.0, 2.0, 4.0)
    assert bytes(reader.data()) == b'\x10\x11'
    assert stamp_of(raw) == STAMP


def test_a_stamp_within_a_message_is_read() -> None:
    writer = CdrWriter(1, '')
    writer.numbers('iI', *divmod(STAMP, 10**9))
    assert stamp_of(writer.raw()[:4] + writer.raw()[-8:]) == STAMP


def test_what_is_skipped_is_not_read() -> None:
    writer = CdrWriter(STAMP, 'map')
    writer.text('unread')
    writer.numbers('3d', 1.0, 2.0, 3.0)
    writer.numbers('I', 4)
    reader = CdrReader(writer.raw())
    reader.skip_text()
    reader.skip('3d')
    assert reader.numbers('I') == (4,)


def test_an_empty_sequence_aligns_nothing() -> None:
    writer = CdrWriter()
    writer.zeros('2I')
    writer.numbers('I', 5)
    reader = CdrReader(writer.raw(), has_header=False)
    assert (reader.sequence('d'), reader.sequence('d'), reader.numbers('I')) == ((), (), (5,))


@pytest.mark.parametrize('size', range(len(_message('<')) - 1))
def test_a_message_cut_off_is_refused(size: int) -> None:
    with pytest.raises(MessageError, match=f'a message of {size} bytes'):
        _read_all(_message('<')[:size])


def _read_all(raw: bytes) -> None:
    reader = CdrReader(raw)
    reader.texts(2)
    reader.skip('B')
    reader.numbers('d')
    reader.sequence('f')
    reader.data()


def test_a_sequence_longer_than_its_message_is_refused() -> None:
    writer = CdrWriter()
    writer.numbers('I', 0xFFFFFFFF)
    with pytest.raises(MessageError, match='too short'):
        CdrReader(writer.raw(), has_header=False).sequence('d')


@pytest.mark.parametrize('raw', [b'', b'\0\7\0\0' + bytes(8), b'\1\0\0\0' + bytes(8)])
def test_another_encapsulation_is_refused(raw: bytes) -> None:
    with pytest.raises(MessageError, match='not plain CDR'):
        CdrReader(raw)


@pytest.mark.parametrize('text', [b'\0\0\0\0', b'\2\0\0\0\xff\0'])
def test_a_text_without_end_or_of_another_encoding_is_refused(text: bytes) -> None:
    with pytest.raises(MessageError):
        CdrReader(BEGIN + text, has_header=False).text()


def test_a_message_too_short_for_a_stamp_is_refused() -> None:
    with pytest.raises(MessageError, match='a message of 11 bytes'):
        stamp_of(BEGIN + bytes(7))


def test_with_another_stamp_two_ticks_are_the_same() -> None:
    first, second = (CdrWriter(stamp_ns, 'map').raw() for stamp_ns in (1, STAMP))
    assert first != second
    assert with_stamp(first, STAMP) == second
