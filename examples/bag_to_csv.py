"""Write a topic of a bag as comma-separated values, with the library rosbags alone.

python examples/bag_to_csv.py BAG /state state.csv
"""

from collections.abc import Iterator
import csv
from dataclasses import fields
from pathlib import Path
import sys
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

LONGEST = 64  # longer arrays, such as the pixels of images, are left out


def columns(value: Any, name: str = '') -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - any part
    """Yield each number and text of a message by its dotted name, diagnostics by their keys."""
    if hasattr(value, '__msgtype__'):
        names = [one.name for one in fields(value) if not hasattr(type(value), one.name)]
        for one in names:  # the rest are constants
            yield from columns(getattr(value, one), f'{name}.{one}' if name else one)
    elif isinstance(value, str) or not hasattr(value, '__len__'):
        yield name, value
    elif len(value) <= LONGEST:
        for index, element in enumerate(value):
            if getattr(element, '__msgtype__', '') == 'diagnostic_msgs/msg/KeyValue':
                yield f'{name}.{element.key}', element.value
            else:
                yield from columns(element, f'{name}[{index}]')


if not sys.argv[3:]:
    sys.exit(__doc__)
bag, topic, file = sys.argv[1:4]
rows = []
with AnyReader([Path(bag)], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
    chosen = [one for one in reader.connections if one.topic == topic]
    for connection, time_ns, data in reader.messages(chosen) if chosen else ():
        message = reader.deserialize(data, connection.msgtype)
        rows.append({'time_ns': time_ns, **dict(columns(message))})
if not rows:
    sys.exit(f'{bag} has no message of {topic}')
with Path(file).open('w', newline='') as stream:
    writer = csv.DictWriter(stream, fieldnames={name: None for row in rows for name in row})
    writer.writeheader()
    writer.writerows(rows)
print(f'{len(rows)} messages: {file}')
