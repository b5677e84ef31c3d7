"""Options of a recording and of a replay."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from goalreach_bags.topic import StorageOptions, TopicSelection
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.options import REQUIRED, CommandOptions, option


def _read_text(path: str) -> str:
    try:
        return Path(path).read_text(encoding='utf-8')
    except OSError as error:
        raise FileFormatError(path, f'cannot be read: {error.strerror}') from None


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
    with_run: str | None = option(
        None, 'clock of the run that the recorder belongs to', choices=('lockstep', 'realtime'),
        hidden=True,
    )  # fmt: skip
    parameters: str = option(
        '', 'parameter file of the run, kept in the bag as text', hidden=True, parse=_read_text
    )


@dataclass(frozen=True, kw_only=True)
class ReplayOptions(CommandOptions):
    """Options of a replay."""

    bag: Path = option(REQUIRED, 'the bag', positional=True, metavar='DIR')
    selection: TopicSelection = field(default_factory=TopicSelection)
    rate: float = option(1.0, 'playback speed as a multiple of the recorded speed', above=0.0)
    loop: bool = option(False, 'start again at the end, until Ctrl-C')
    start: float = option(
        0.0, 'start at this time after the first message, seconds', metavar='S', minimum=0.0
    )
    duration: float | None = option(
        None, 'play only this much of the bag, seconds', metavar='S', above=0.0
    )
    delay: float = option(
        0.5, 'time for subscribers to connect, seconds', metavar='S', minimum=0.0
    )
    clock: bool = option(False, 'publish /clock')
    paused: bool = option(False, 'start paused; space continues, s steps')
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
