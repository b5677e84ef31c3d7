"""The `record` command: a rosbag2 recording of the running graph."""

from __future__ import annotations

import argparse
from pathlib import Path
import time

from goalreach_bags.recording import RecordOptions
from goalreach_bags.topic import STORAGES, StorageOptions, TopicSelection
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError

SUMMARY = 'Record the running graph into a rosbag2 directory, or repair one'

_MB = 1_000_000
_NS_PER_S = 1_000_000_000


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add('bag', type=Path, nargs='?', metavar='DIR', help='bag to make; by default goalreach-TIME')
    add('--topics', nargs='+', default=(), metavar='NAME', help='topics by name (default: all)')
    add('--regex', action='append', default=[], metavar='PATTERN', help='topics by pattern')
    add('--exclude', action='append', default=[], metavar='PATTERN', help='topics to leave out')
    add('--storage', choices=STORAGES, default='mcap', help='storage format')
    add('--zstd', action='store_true', help='compress')
    add('--max-size', type=float, metavar='MB', help='begin a new file at this size')
    add('--max-duration', type=float, metavar='S', help='begin a new file after this time')
    add('--duration', type=float, metavar='S', help='stop by itself after these wall seconds')
    add(
        '--use-sim-time',
        action=argparse.BooleanOptionalAction,
        default=None,
        help='take times from /clock (default: where the graph has one)',
    )
    add('--repair', action='store_true', help='repair the bag DIR of a recorder that was killed')
    add('--with-run', choices=('lockstep', 'realtime'), help=argparse.SUPPRESS)
    add('--parameters', type=Path, help=argparse.SUPPRESS)


def execute(options: argparse.Namespace) -> int:
    """Record until Ctrl-C; return 0 where the whole recording is in the bag.

    Raises:
        GoalreachError: An option is refused, or the bag cannot be made or repaired.
    """
    if options.repair:
        if options.bag is None:
            raise ConfigurationError('--repair', '', 'followed by the bag')
        from goalreach_bags.repair import repair_bag

        print(repair_bag(options.bag))
        return 0
    from goalreach_bags.ros.recorder import record

    result = record(_options(options))
    print(result)
    return 1 if result.stopped else 0


def _options(options: argparse.Namespace) -> RecordOptions:
    for name in ('max_size', 'max_duration', 'duration'):
        value = getattr(options, name)
        if value is not None and not value > 0:
            raise ConfigurationError(f'--{name.replace("_", "-")}', value, 'greater than 0')
    default = Path(time.strftime('goalreach-%Y-%m-%d-%H-%M-%S'))
    return RecordOptions(
        path=options.bag or default,
        selection=TopicSelection(
            names=tuple(options.topics),
            patterns=tuple(options.regex),
            exclude=tuple(options.exclude),
        ),
        storage=StorageOptions(
            storage=options.storage,
            zstd=options.zstd,
            max_bytes=_times(options.max_size, _MB),
            max_duration_ns=_times(options.max_duration, _NS_PER_S),
        ),
        sim_time=options.use_sim_time,
        duration_s=options.duration,
        with_run=options.with_run,
        parameters=_read(options.parameters),
    )


def _times(value: float | None, factor: int) -> int | None:
    return None if value is None else round(value * factor)


def _read(path: Path | None) -> str:
    if path is None:
        return ''
    try:
        return path.read_text(encoding='utf-8')
    except OSError as error:
        raise FileFormatError(path, f'cannot be read: {error.strerror}') from None
