"""Reading, writing, comparing and repairing rosbag2 bags.

Each name is imported with its module on first use: a command that needs `RecordOptions` alone
loads neither rosbags nor mcap.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from goalreach_bags.compare import compare_bags, differences
    from goalreach_bags.decode import Decoder, flatten
    from goalreach_bags.export import MessageTable, write_table
    from goalreach_bags.options import (
        RecordOptions,
        ReplayOptions,
        StorageOptions,
        TopicSelection,
    )
    from goalreach_bags.reader import BagMessage, BagReader
    from goalreach_bags.repair import RepairResult, repair_bag
    from goalreach_bags.run_series import RunSeries, read_run_series
    from goalreach_bags.storage import BagError, BagStoppedError
    from goalreach_bags.topic import BagTopic, message_definition
    from goalreach_bags.writer import BagWriter

_EXPORTS = {
    'compare': ('compare_bags', 'differences'),
    'decode': ('Decoder', 'flatten'),
    'export': ('MessageTable', 'write_table'),
    'options': ('RecordOptions', 'ReplayOptions', 'StorageOptions', 'TopicSelection'),
    'reader': ('BagMessage', 'BagReader'),
    'repair': ('RepairResult', 'repair_bag'),
    'run_series': ('RunSeries', 'read_run_series'),
    'storage': ('BagError', 'BagStoppedError'),
    'topic': ('BagTopic', 'message_definition'),
    'writer': ('BagWriter',),
}
__all__ = [
    'BagError',
    'BagMessage',
    'BagReader',
    'BagStoppedError',
    'BagTopic',
    'BagWriter',
    'Decoder',
    'MessageTable',
    'RecordOptions',
    'RepairResult',
    'ReplayOptions',
    'RunSeries',
    'StorageOptions',
    'TopicSelection',
    'compare_bags',
    'differences',
    'flatten',
    'message_definition',
    'read_run_series',
    'repair_bag',
    'write_table',
]


def __getattr__(name: str) -> object:
    for module, names in _EXPORTS.items():
        if name in names:
            return getattr(import_module(f'{__name__}.{module}'), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
