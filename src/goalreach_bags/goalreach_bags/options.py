"""Options of a recording and of a replay: which topics, how stored, how played."""

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
import re

from goalreach_bags.storage import STORAGES
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.files import read_text
from goalreach_msgs_py.options import REQUIRED, CommandOptions, option, parse_namespace
from goalreach_msgs_py.topics import CLOCK


@dataclass(frozen=True, kw_only=True)
class TopicSelection:
    """Selects topics by name and by pattern; all where neither is given.

    Hidden topics, those with a part that begins with an underscore, are selected only by name.
    """

    names: tuple[str, ...] = option(
        (), 'topics by name, with or without the leading slash (default: all)', flag='--topics',
        metavar='NAME',
    )  # fmt: skip
    patterns: tuple[str, ...] = option(
        (), 'topics whose name matches; repeatable', flag='--regex', aliases=('-e',),
        metavar='PATTERN', repeatable=True,
    )  # fmt: skip
    exclude: tuple[str, ...] = option(
        (), 'leave out topics whose name matches; repeatable', flag='--exclude-regex',
        aliases=('--exclude', '-x'), metavar='PATTERN', repeatable=True,
    )  # fmt: skip
    excluded_names: tuple[str, ...] = option(
        (), 'leave out topics by name', flag='--exclude-topics', metavar='NAME'
    )

    def __post_init__(self) -> None:
        for flag, patterns in (('--regex', self.patterns), ('--exclude', self.exclude)):
            for pattern in patterns:
                _require_pattern(flag, pattern)

    def includes(self, topic: str) -> bool:
        """Return whether a topic is selected."""
        if topic in _full_names(self.excluded_names):
            return False
        if topic in self.full_names:
            return True
        hidden = any(part.startswith('_') for part in topic.split('/'))
        if hidden or any(re.search(pattern, topic) for pattern in self.exclude):
            return False
        if self.patterns:
            return any(re.search(pattern, topic) for pattern in self.patterns)
        return not self.names

    @property
    def full_names(self) -> frozenset[str]:
        """The names with their leading slash."""
        return _full_names(self.names)


def _full_names(names: tuple[str, ...]) -> frozenset[str]:
    return frozenset(name if name.startswith('/') else f'/{name}' for name in names)


def _require_pattern(flag: str, pattern: str) -> None:
    try:
        re.compile(pattern)
    except re.error as error:
        raise ConfigurationError(flag, pattern, f'a pattern: {error}') from None


@dataclass(frozen=True, kw_only=True)
class StorageOptions(CommandOptions):
    """Storage format of a bag, its compression, and when it is split into further files."""

    storage: str = option('mcap', 'storage format', choices=STORAGES)
    zstd: bool = option(
        False, 'compress: MCAP by the chunk, SQLite by the message, as rosbag2 does'
    )
    max_size: float | None = option(None, 'start a new file at this size', metavar='MB', above=0.0)
    max_duration: float | None = option(
        None, 'start a new file after this time, seconds', metavar='S', above=0.0
    )


@dataclass(frozen=True, kw_only=True)
class RecordOptions(CommandOptions):
    """Options of a recording."""

    bag: Path | None = option(
        None, 'bag to make (default: goalreach-TIME)', positional=True, metavar='DIR'
    )
    selection: TopicSelection = field(default_factory=TopicSelection)
    storage: StorageOptions = field(default_factory=StorageOptions)
    duration: float | None = option(
        None, 'stop after this wall time, seconds', metavar='S', above=0.0
    )
    use_sim_time: bool | None = option(
        None, 'take times from /clock (default: where the graph has one)'
    )
    repair: bool = option(False, 'repair the bag DIR of a recorder that was killed')
    replace: bool = option(False, 'with --repair: do not keep damaged files as NAME.damaged')
    robots: tuple[str, ...] = option(
        (), 'namespace of a run in lockstep that waits for the recorder; repeatable',
        flag='--robot', metavar='NAME', repeatable=True,
        parse=partial(parse_namespace, flag='--robot'),
    )  # fmt: skip
    clock_topic: str = option(CLOCK, 'clock of the run', hidden=True)
    with_run: str | None = option(
        None, 'clock of the run that the recorder belongs to', choices=('lockstep', 'realtime'),
        hidden=True,
    )  # fmt: skip
    parameters: str = option(
        '', 'parameter file of the run, kept in the bag as text', hidden=True, parse=read_text
    )


@dataclass(frozen=True, kw_only=True)
class ReplayOptions(CommandOptions):
    """Options of a replay."""

    bag: Path = option(REQUIRED, 'the bag', positional=True, metavar='DIR')
    selection: TopicSelection = field(default_factory=TopicSelection)
    remap: tuple[str, ...] = option(
        (), 'publish topics under other names', aliases=('-m',), metavar='FROM:=TO'
    )
    qos_profile_overrides_path: Path | None = option(
        None, 'quality of service by topic, in the format of ros2 bag play', metavar='YAML'
    )
    rate: float = option(
        1.0, 'playback speed as a multiple of the recorded speed', aliases=('-r',), above=0.0
    )
    loop: bool = option(False, 'start again at the end, until Ctrl-C', aliases=('-l',))
    start: float = option(
        0.0, 'start at this time after the first message, seconds', metavar='S', minimum=0.0
    )
    duration: float | None = option(
        None, 'play only this much of the bag, seconds', metavar='S', above=0.0
    )
    delay: float = option(
        0.5, 'time for subscribers to connect before the first message, seconds', aliases=('-d',),
        metavar='S', minimum=0.0,
    )  # fmt: skip
    wait_for_all_acked: int | None = option(
        None, 'at the end, wait until reliable subscribers have acknowledged all messages, '
        'milliseconds; 0 waits without limit (default: 300)', metavar='MS', minimum=0,
    )  # fmt: skip
    clock: bool = option(False, 'publish /clock')
    paused: bool = option(
        False, 'start paused; space or the service /player/resume (std_srvs/srv/Trigger) '
        'continues, s or /player/play_next steps', flag='--start-paused',
        aliases=('--paused', '-p'),
    )  # fmt: skip
    quiet: bool = option(False, 'show no progress')
    recompute: bool = option(
        False,
        'feed the recorded sensors to live perception and state estimation, and '
        'compare what they publish with what was recorded',
    )
    tolerance: float = option(
        1e-9, 'with --recompute: largest difference of a field that is accepted', metavar='X'
    )
    params_file: Path | None = option(
        None, 'with --recompute: parameters that replace the recorded ones', metavar='YAML'
    )
