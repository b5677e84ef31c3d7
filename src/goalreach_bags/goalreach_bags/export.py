"""Export of a topic as a table: one row per message, one column per number or text."""

import csv
from dataclasses import dataclass, field
import importlib
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np

from goalreach_bags.decode import flatten
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.files import write_bytes_atomically

Cell = float | int | str | bool | None


@dataclass
class MessageTable:
    """Collects messages.

    Attributes:
        max_array: Longest array that becomes columns.
        rows: Number of messages.
        columns: Values by column; None where a message has no such field.
        left_out: Names of longer arrays, such as the pixels of images.
    """

    max_array: int
    rows: int = 0
    columns: dict[str, list[Cell]] = field(default_factory=dict)
    left_out: set[str] = field(default_factory=set)

    def add(self, time_ns: int, message: object) -> None:
        """Add a message.

        Args:
            time_ns: Its receive time.
            message: The decoded message.
        """
        self._put('time_ns', time_ns)
        for name, value in flatten(message):
            if isinstance(value, np.ndarray):
                self._put_array(name, value)
            else:
                self._put(name, value.item() if isinstance(value, np.generic) else value)
        self.rows += 1
        for values in self.columns.values():
            values.extend([None] * (self.rows - len(values)))

    def _put_array(self, name: str, values: np.ndarray[Any, Any]) -> None:
        if values.size > self.max_array:
            self.left_out.add(name)
            self._put(f'{name}.length', int(values.size))
            return
        for index, value in enumerate(values.tolist()):
            self._put(f'{name}[{index}]', value)

    def _put(self, name: str, value: Cell) -> None:
        self.columns.setdefault(name, [None] * self.rows).append(value)

    def make_numbers(self) -> None:
        """Convert columns of numbers that are texts, as in diagnostics.

        Only texts that a number would be written as are converted: '007' stays a text.
        """
        for name, values in self.columns.items():
            texts = [value for value in values if value is not None]
            if all(isinstance(text, str) and _is_number(text) for text in texts):
                self.columns[name] = [None if v is None else float(v) for v in values]


def _is_number(text: str) -> bool:
    try:
        number = float(text)
        return text in (repr(number), str(int(number)))
    except (ValueError, OverflowError):
        return False


def write_table(path: Path, table: MessageTable) -> None:
    """Write a table in the format of the file's ending.

    Raises:
        GoalreachError: The ending is another, pyarrow is missing, or the file cannot be written.
    """
    if path.suffix == '.csv':
        text = StringIO()
        writer = csv.writer(text, lineterminator='\n')
        writer.writerow(table.columns)
        writer.writerows(zip(*table.columns.values(), strict=True))
        write_bytes_atomically(path, text.getvalue().encode())
    elif path.suffix == '.parquet':
        write_bytes_atomically(path, _parquet(table))
    else:
        raise ConfigurationError('--out', str(path), 'a name ending in .csv or .parquet')


def _parquet(table: MessageTable) -> bytes:
    try:
        arrow: Any = importlib.import_module('pyarrow')
        parquet: Any = importlib.import_module('pyarrow.parquet')
    except ModuleNotFoundError:
        raise GoalreachError('Parquet needs pyarrow: pip install pyarrow') from None
    content = BytesIO()
    parquet.write_table(arrow.table(table.columns), content)
    return content.getvalue()
