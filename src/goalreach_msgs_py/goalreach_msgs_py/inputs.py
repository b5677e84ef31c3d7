"""The inputs of a node: joining messages of several topics by stamp, and detecting bad inputs.

DDS does not preserve order between topics, so a node acts on a stamp once all its inputs of that
stamp have arrived.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

_NS_PER_S = 1e9
_STALLED_S = 0.5
"""A node that was not served for this long reports it, seconds of the wall clock. Chosen."""
_SILENT_S = 1.0
"""Silence that is reported, seconds of the wall clock. Chosen."""
_APART_NS = 300_000_000
"""Difference of stamps that is reported, nanoseconds of the graph's clock. Chosen."""
_RECENT_S = 0.2
"""Stamps are compared with inputs received this recently only: a silent one
is reported as such. Chosen."""
_ABSENT_S = 5.0
"""An input that has not come for this long after another did is reported: longer than discovery
takes. Chosen."""
_REPORTED_LOSSES = 3
"""Fewer lost messages are not reported. Chosen."""


class StampSynchronizer:
    """Collects values by stamp and returns each complete set once.

    Args:
        names: The inputs that make a set.
        depth: How many incomplete stamps are kept; the one that came first is dropped first, so
            that a stamp from the future does not stay for long.

    >>> inputs = StampSynchronizer(['image', 'odom'])
    >>> inputs.add('image', 5, 'I')
    >>> inputs.add('odom', 5, 'O')
    {'image': 'I', 'odom': 'O'}

    Attributes:
        missing: How often each input was missing from a stamp that was dropped, since the first
            complete set.
    """

    def __init__(self, names: Sequence[str], *, depth: int = 16) -> None:
        self._names = tuple(names)
        self._depth = depth
        self._pending: dict[int, dict[str, Any]] = {}
        self._last_stamp_ns: int | None = None
        self.missing = dict.fromkeys(self._names, 0)

    def add(self, name: str, stamp_ns: int, value: object) -> Mapping[str, Any] | None:
        """Add one input; return the set when it is complete.

        Args:
            name: One of the names given at construction.
            stamp_ns: Stamp of the value, nanoseconds.
            value: The value.

        Returns:
            The complete set by name, or None. A stamp older than the last complete set is
            dropped; the stamp of the last complete set itself may be completed again (a sender
            that repeats itself, asking for the answer once more).

        Raises:
            KeyError: The name is not an input of this synchronizer.
        """
        if name not in self._names:
            raise KeyError(name)
        if self._last_stamp_ns is not None and stamp_ns < self._last_stamp_ns:
            return None
        collected = self._pending.setdefault(stamp_ns, {})
        collected[name] = value
        if len(collected) == len(self._names):
            del self._pending[stamp_ns]
            for older_ns in [s for s in self._pending if s < stamp_ns]:
                self._drop(older_ns)
            self._last_stamp_ns = stamp_ns
            return collected
        if len(self._pending) > self._depth:
            self._drop(next(iter(self._pending)))
        return None

    def _drop(self, stamp_ns: int) -> None:
        collected = self._pending.pop(stamp_ns)
        if self._last_stamp_ns is not None:
            for name in self._names:
                self.missing[name] += name not in collected


@dataclass(frozen=True, kw_only=True)
class InputProblem:
    """Something wrong with the inputs.

    Attributes:
        topic: The input, or an empty text for the node itself.
        kind: 'silent', 'apart', 'lost', 'duplicate', 'order' or 'stalled'.
        text: One line for people, without the topic.
    """

    topic: str
    kind: str
    text: str

    @property
    def is_harmless(self) -> bool:
        """Whether nodes handle it without a loss."""
        return self.kind in {'duplicate', 'order'}


@dataclass
class _Input:
    stamp_ns: int
    received_s: float
    lost: int = 0


class InputMonitor:
    """Checks stamps and arrival times of the topics that a node joins.

    An input is silent when it stops, or never comes, while another continues; when all stop,
    their common sender has ended or is paused, which is not reported here. An input is apart when
    its stamps differ from those of the others by more than a node tolerates.

    Args:
        required: The inputs that are reported when they never come.
    """

    def __init__(self, required: Iterable[str] = ()) -> None:
        self._required = tuple(required)
        self._inputs: dict[str, _Input] = {}
        self._checked_s: float | None = None
        self._first_s: float | None = None

    def received(self, topic: str, stamp_ns: int, now_s: float) -> InputProblem | None:
        """Record a message; return what is wrong with it, or None.

        Args:
            topic: One of the inputs.
            stamp_ns: Stamp of the message, nanoseconds.
            now_s: The present time of a steady clock.
        """
        last = self._inputs.get(topic)
        if last is None:
            self._inputs[topic] = _Input(stamp_ns, now_s)
            self._first_s = now_s if self._first_s is None else self._first_s
            return None
        before_ns, last.stamp_ns, last.received_s = last.stamp_ns, stamp_ns, now_s
        problem = self._find_apart(topic, stamp_ns, now_s)
        if problem is not None or stamp_ns > before_ns:
            return problem
        if stamp_ns == before_ns:
            return InputProblem(topic=topic, kind='duplicate', text='a message came twice')
        early_s = (before_ns - stamp_ns) / _NS_PER_S
        text = f'out of order: {early_s:.2f} s before the last'
        return InputProblem(topic=topic, kind='order', text=text)

    def _find_apart(self, topic: str, stamp_ns: int, now_s: float) -> InputProblem | None:
        for other, last in self._inputs.items():
            apart_ns = stamp_ns - last.stamp_ns
            if -_APART_NS <= apart_ns <= _APART_NS or now_s - last.received_s > _RECENT_S:
                continue
            where = 'ahead of' if apart_ns > 0 else 'behind'
            text = f'{abs(apart_ns) / _NS_PER_S:.2f} s {where} {other}'
            return InputProblem(topic=topic, kind='apart', text=text)
        return None

    def check(self, now_s: float, missing: Mapping[str, int] | None = None) -> list[InputProblem]:
        """Return what is wrong now; to be called several times a second.

        Args:
            now_s: The present time of a steady clock.
            missing: How often each input has been missing so far, where that is counted.
        """
        stalled_s = 0.0 if self._checked_s is None else now_s - self._checked_s
        self._checked_s = now_s
        if stalled_s > _STALLED_S:
            for last in self._inputs.values():
                last.received_s = now_s
            return [InputProblem(topic='', kind='stalled', text=f'stalled for {stalled_s:.2f} s')]
        return [*self._find_silent(now_s), *self._find_lost(missing or {})]

    def _find_silent(self, now_s: float) -> list[InputProblem]:
        ages_s = {topic: now_s - last.received_s for topic, last in self._inputs.items()}
        if not any(age_s <= 0.5 * _SILENT_S for age_s in ages_s.values()):
            return []
        silent = {topic: age_s for topic, age_s in ages_s.items() if age_s > _SILENT_S}
        if self._first_s is not None and now_s - self._first_s > _ABSENT_S:
            absent = (topic for topic in self._required if topic not in self._inputs)
            silent |= dict.fromkeys(absent, now_s - self._first_s)
        return [
            InputProblem(topic=topic, kind='silent', text=f'nothing for {age_s:.1f} s')
            for topic, age_s in silent.items()
        ]

    def _find_lost(self, missing: Mapping[str, int]) -> list[InputProblem]:
        problems = []
        for topic, count in missing.items():
            last = self._inputs.get(topic)
            if last is not None and count - last.lost >= _REPORTED_LOSSES:
                text = f'{count - last.lost} messages were missing'
                problems.append(InputProblem(topic=topic, kind='lost', text=text))
                last.lost = count
        return problems
