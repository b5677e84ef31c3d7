"""Tables as CSV and Parquet files."""

from __future__ import annotations

import csv
import importlib
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, Final

from goalreach_bringup.bags.table import MessageTable
from goalreach_msgs_py.atomic_file import write_bytes_atomically
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError

__all__ = ['ENDINGS', 'write_table']

ENDINGS: Final = ('.csv', '.parquet')


def write_table(path: Path, table: MessageTable) -> None:
    """Write a table in the format of the file's ending.

    Raises:
        GoalreachError: The ending is another, pyarrow is missing, or the file cannot be written.
    """
    if path.suffix == '.csv':
        text = StringIO()
        writer = csv.writer(text, lineterminator='\n')
        writer.writerow(table.columns)
        writer.writerows(table.records())
        write_bytes_atomically(path, text.getvalue().encode())
    elif path.suffix == '.parquet':
        write_bytes_atomically(path, _parquet(table))
    else:
        raise ConfigurationError('--out', str(path), f'a name ending in {" or ".join(ENDINGS)}')


def _parquet(table: MessageTable) -> bytes:
    try:
        arrow: Any = importlib.import_module('pyarrow')
        parquet: Any = importlib.import_module('pyarrow.parquet')
    except ModuleNotFoundError:
        raise GoalreachError(
            "Parquet needs pyarrow: pip install 'goalreach[parquet]'; CSV needs nothing"
        ) from None
    content = BytesIO()
    parquet.write_table(arrow.table(table.columns), content)
    return content.getvalue()
