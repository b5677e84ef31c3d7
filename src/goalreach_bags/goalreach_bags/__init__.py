"""Reading, writing, comparing and repairing rosbag2 bags.

Each name is imported with its module on first use: a command that needs `RecordOptions` alone
loads neither rosbags nor mcap.
"""

from typing import TYPE_CHECKING

from goalreach_msgs_py.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from goalreach_bags.compare import compare_bags as compare_bags
    from goalreach_bags.compare import differences as differences
    from goalreach_bags.decode import Decoder as Decoder
    from goalreach_bags.decode import flatten as flatten
    from goalreach_bags.export import MessageTable as MessageTable
    from goalreach_bags.export import write_table as write_table
    from goalreach_bags.options import RecordOptions as RecordOptions
    from goalreach_bags.options import ReplayOptions as ReplayOptions
    from goalreach_bags.options import StorageOptions as StorageOptions
    from goalreach_bags.options import TopicSelection as TopicSelection
    from goalreach_bags.reader import BagReader as BagReader
    from goalreach_bags.repair import RepairResult as RepairResult
    from goalreach_bags.repair import repair_bag as repair_bag
    from goalreach_bags.run_series import RunSeries as RunSeries
    from goalreach_bags.run_series import read_run_series as read_run_series
    from goalreach_bags.storage import BagError as BagError
    from goalreach_bags.storage import BagMessage as BagMessage
    from goalreach_bags.storage import BagStoppedError as BagStoppedError
    from goalreach_bags.topic import BagTopic as BagTopic
    from goalreach_bags.topic import message_definition as message_definition
    from goalreach_bags.writer import BagWriter as BagWriter

__all__, __getattr__, __dir__ = lazy_exports(__name__)
