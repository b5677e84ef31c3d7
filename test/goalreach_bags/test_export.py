"""Messages as tables: columns, numbers and files."""

from pathlib import Path

import pytest

from goalreach_bags.export import MessageTable, write_table
from goalreach_msgs_py.errors import ConfigurationError
from small_bags import joints, status


def test_table_has_a_column_per_field_and_leaves_long_arrays_out() -> None:
    table = MessageTable(max_array=2)
    table.add(5, joints([1.0, 2.0]))
    table.add(6, joints([1.0, 2.0, 3.0]))
    table.add(7, status(x_m='1.5', r='A'))
    table.make_numbers()

    assert table.rows == 3
    assert table.left_out == {'position'}
    assert table.columns['time_ns'] == [5, 6, 7]
    assert table.columns['position[1]'] == [2.0, None, None]
    assert table.columns['position.length'] == [None, 3, None]
    assert table.columns['values.x_m'] == [None, None, 1.5]
    assert table.columns['values.r'] == [None, None, 'A']
    assert 'OK' not in table.columns, 'constants are no fields'


@pytest.mark.parametrize('text', ['007', '1e400', '1_000', ' 1', '+1', '9007199254740993'])
def test_texts_that_only_look_like_numbers_stay_texts(text: str) -> None:
    table = MessageTable(max_array=2)
    table.add(5, status(serial=text))
    table.add(6, status(serial='1'))
    table.make_numbers()

    assert table.columns['values.serial'] == [text, '1']


def test_tables_are_written_by_their_ending(tmp_path: Path) -> None:
    table = MessageTable(max_array=2)
    table.add(5, joints([1.0, 2.0]))

    write_table(tmp_path / 'a.csv', table)
    assert (tmp_path / 'a.csv').read_text().splitlines()[0].startswith('time_ns,header.stamp.sec')
    with pytest.raises(ConfigurationError, match=r'\.csv or \.parquet'):
        write_table(tmp_path / 'a.xlsx', table)


def test_parquet_holds_the_same(tmp_path: Path) -> None:
    parquet = pytest.importorskip('pyarrow.parquet')
    table = MessageTable(max_array=2)
    table.add(5, joints([1.0, 2.0]))

    write_table(tmp_path / 'a.parquet', table)

    read = parquet.read_table(tmp_path / 'a.parquet').to_pydict()
    assert read['position[1]'] == [2.0]
    assert read['time_ns'] == [5]
