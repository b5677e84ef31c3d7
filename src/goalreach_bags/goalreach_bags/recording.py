"""Topics of a run that a recording expects, and the result of a recording."""

from collections.abc import Mapping
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Final

from goalreach_msgs_py import topics

TICK_TOPICS: Final = (
    topics.CLOCK,
    topics.GROUND_TRUTH,
    *topics.SENSORS,
    topics.POSE,
    topics.LANDMARKS,
    topics.HEAD_COMMAND,
    topics.STATE,
    topics.CMD_VEL,
)
"""Topics with one message in each tick of a run."""

RUN_TOPICS: Final = (
    *TICK_TOPICS,
    topics.MARKERS,
    topics.TRANSITION,
    topics.Q_TABLE,
    topics.PATH,
    topics.DIAGNOSTICS,
)
"""All topics of a run's four nodes."""

LOST_KEY: Final = 'goalreach.lost'
CLOCK_KEY: Final = 'goalreach.clock'
PARAMETERS_KEY: Final = 'goalreach.parameters'


@dataclass(frozen=True, kw_only=True)
class RecordingResult:
    """Result of a recording.

    Attributes:
        path: The bag.
        counts: Messages by topic.
        lost: Lost messages by topic, where there are any.
        duration_s: Time between first and last message.
        size_bytes: Size of the bag.
        stopped: Why the recording ended early, or empty.
    """

    path: Path
    counts: Mapping[str, int]
    lost: Mapping[str, int]
    duration_s: float
    size_bytes: int
    stopped: str = ''

    def __str__(self) -> str:
        lost = ', '.join(f'{count} of {name}' for name, count in sorted(self.lost.items()))
        return (
            f'recorded {sum(self.counts.values())} messages of {len(self.counts)} topics, '
            f'{self.duration_s:.1f} s, {self.size_bytes / 1e6:.1f} MB, lost '
            f'{lost or "none"}{", stopped early" if self.stopped else ""}: {self.path}'
        )


def recording_texts(lost: Mapping[str, int], *, sim_time: bool) -> dict[str, str]:
    """Return the texts of a recording that its bag keeps, by key.

    Args:
        lost: Lost messages by topic.
        sim_time: Whether receive times are those of `/clock`.
    """
    return {LOST_KEY: json.dumps(dict(lost)), CLOCK_KEY: 'sim' if sim_time else 'wall'}


def lost_messages(texts: Mapping[str, str]) -> dict[str, int]:
    """Return the lost messages by topic in the texts of a bag; none where it has no count."""
    try:
        lost = json.loads(texts.get(LOST_KEY, '{}'))
        return {str(name): int(count) for name, count in lost.items()}
    except (ValueError, TypeError, AttributeError):
        return {}
