"""The example writes a topic of any bag as a table."""

import csv
from pathlib import Path
import subprocess
import sys

import pytest

from goalreach_bags.topic import BagTopic, message_definition
from small_bags import JOINTS, STORE, joints, serialize, status, write_bag

EXAMPLE = Path(__file__).parents[2] / 'examples' / 'bag_to_csv.py'
STATUS = 'diagnostic_msgs/msg/DiagnosticStatus'


def topic(name: str, type_name: str) -> BagTopic:
    definition = message_definition(type_name)
    return BagTopic(
        name=name, type_name=type_name, type_hash=STORE.hash_rihs01(type_name), offers=(),
        definition=definition,
    )  # fmt: skip


def table(bag: Path, name: str) -> list[dict[str, str]]:
    words = [sys.executable, str(EXAMPLE), str(bag), name, str(bag.with_suffix('.csv'))]
    subprocess.run(words, timeout=60, check=True)
    with bag.with_suffix('.csv').open(newline='') as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_table_has_a_row_per_message_and_a_column_per_field(
    tmp_path: Path, storage: str
) -> None:
    messages = [
        ('/joints', 5, serialize(joints([1.0, 2.0]), JOINTS)),
        ('/joints', 6, serialize(joints([1.0] * 65), JOINTS)),
        ('/status', 7, serialize(status(x_m='1.5', r='A'), STATUS)),
    ]
    topics = (topic('/joints', JOINTS), topic('/status', STATUS))
    write_bag(tmp_path / 'bag', messages, topics=topics, storage=storage)

    first, second = table(tmp_path / 'bag', '/joints')
    assert (first['time_ns'], first['position[1]']) == ('5', '2.0')
    assert first['header.frame_id'] == 'map'
    assert second['position[1]'] == '', 'an array of 65 is left out'
    (row,) = table(tmp_path / 'bag', '/status')
    assert (row['values.x_m'], row['values.r']) == ('1.5', 'A')
    assert 'OK' not in row, 'constants are no fields'


def test_a_topic_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', [('/joints', 5, b'')][:0], topics=(topic('/joints', JOINTS),))
    words = [sys.executable, str(EXAMPLE), str(tmp_path / 'bag'), '/pose', str(tmp_path / 'a.csv')]
    found = subprocess.run(words, timeout=60, check=False, capture_output=True, text=True)
    assert found.returncode == 1
    assert found.stderr.strip().endswith('bag has no message of /pose')
    assert not (tmp_path / 'a.csv').exists()
