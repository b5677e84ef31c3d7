"""The `record` command: a rosbag2 recording of the running graph."""

from goalreach_bags.options import RecordOptions as Options
from goalreach_msgs_py.errors import ConfigurationError

SUMMARY = 'Record the running graph into a rosbag2 directory, or repair one'


def execute(options: Options) -> int:
    """Record until Ctrl-C; return 0 where the whole recording is in the bag."""
    if not options.repair:
        from goalreach_bags.ros.recorder import record

        line, whole = record(options)
        print(line)
        return 0 if whole else 1
    if options.bag is None:
        raise ConfigurationError('--repair', '', 'followed by the bag')
    from goalreach_bags.repair import repair_bag

    print(repair_bag(options.bag, replace_files=options.replace))
    return 0
