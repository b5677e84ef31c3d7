"""Where CDR has what: bytes worked out by hand."""

import struct

import pytest

from goalreach_msgs_py.cdr import (
    CdrLayout,
    Fixed,
    Run,
    pack_text,
    set_stamp,
    stamp_of,
    without_stamp,
)

STAMP = 3_000_000_007
HEAD = bytes([0, 1, 0, 0])
STAMP_BYTES = bytes([3, 0, 0, 0, 7, 0, 0, 0])


def test_numbers_stand_at_multiples_of_their_size() -> None:
    layout = CdrLayout('map', Fixed('B', 7), Run('d'))
    raw = layout.pack(STAMP, [0.5])
    text = bytes([4, 0, 0, 0]) + b'map\0'
    assert raw == HEAD + STAMP_BYTES + text + bytes([7]) + bytes(7) + struct.pack('<d', 0.5)


def test_a_text_counts_its_zero_and_what_follows_is_aligned() -> None:
    raw = CdrLayout('odom', 'x').template
    assert raw[12:] == b'\5\0\0\0odom\0\0\0\0' + b'\2\0\0\0x\0'


def test_no_numbers_still_align_what_follows() -> None:
    assert len(CdrLayout(Fixed('I', 0), Fixed('0d'), Fixed('I', 0)).template) == 12 + 4 + 4 + 4


def test_what_was_packed_is_unpacked_run_by_run() -> None:
    layout = CdrLayout('map', Run('2d'), Fixed('I', 9), Run('f'))
    raw = layout.pack(STAMP, [1.0, 2.0], [0.25])
    assert layout.fits(raw)
    assert layout.unpack(raw) == (1.0, 2.0)
    assert layout.unpack(raw, 1) == (0.25,)
    assert stamp_of(raw) == STAMP


def test_too_few_runs_are_refused() -> None:
    with pytest.raises(ValueError, match='zip'):
        CdrLayout(Run('d')).pack(STAMP)


@pytest.mark.parametrize(
    'other',
    [
        CdrLayout('odo', Run('2d'), Fixed('I', 9)),
        CdrLayout('map', Run('2d'), Fixed('I', 8)),
        CdrLayout('map', Run('2d'), Fixed('2I', 9, 0)),
        CdrLayout('map', Run('2d')),
    ],
)
def test_another_message_does_not_fit(other: CdrLayout) -> None:
    layout = CdrLayout('map', Run('2d'), Fixed('I', 9))
    assert not layout.fits(other.pack(STAMP, [1.0, 2.0]))


def test_big_endian_does_not_fit_but_has_a_stamp() -> None:
    layout = CdrLayout(Run('d'))
    raw = bytes([0, 0, 0, 0]) + struct.pack('>iId', 3, 7, 1.0)
    assert not layout.fits(raw)
    assert stamp_of(raw) == STAMP


def test_up_to_three_bytes_may_follow() -> None:
    layout = CdrLayout(Run('d'))
    raw = layout.pack(STAMP, [1.0])
    assert [layout.fits(raw + bytes(more)) for more in range(5)] == [True] * 4 + [False]
    assert layout.fits(raw + bytes(10), more=8)
    assert not layout.fits(raw, more=1)


def test_a_message_cut_off_has_no_stamp() -> None:
    assert stamp_of(HEAD + bytes(7)) is None


def test_without_stamp_two_ticks_are_the_same() -> None:
    layout = CdrLayout('map', Run('d'))
    assert without_stamp(layout.pack(1, [2.0])) == without_stamp(layout.pack(STAMP, [2.0]))


def test_stamp_is_written_in_place() -> None:
    raw = bytearray(12)
    set_stamp(raw, STAMP)
    assert raw[4:] == STAMP_BYTES


@pytest.mark.parametrize(('text', 'size'), [('', 8), ('abc', 8), ('abcd', 12), ('é', 8)])
def test_texts_end_at_multiples_of_four(text: str, size: int) -> None:
    raw = pack_text(text)
    assert len(raw) == size
    assert raw[4:].rstrip(b'\0').decode() == text
    assert struct.unpack_from('<I', raw) == (len(text.encode()) + 1,)
