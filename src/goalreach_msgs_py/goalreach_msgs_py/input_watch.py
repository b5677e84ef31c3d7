"""Whether the inputs of a node are what they should be: there, in time, once, in order."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

_NS_PER_S = 1e9
_HELD_S = 0.5
"""A node that was not served for so long tells it, seconds of the wall clock; chosen."""

_RECENT_S = 0.2
"""Stamps are held against inputs that go on alone: who is silent is told as such. Chosen."""

_LOST = 3
"""Fewer messages than this are not worth a word; chosen."""


@dataclass(frozen=True, kw_only=True)
class Trouble:
    """Something wrong with the inputs.

    Attributes:
        topic: Which input, or an empty text for the node itself.
        kind: 'silent', 'apart', 'lost', 'twice', 'order' or 'held'.
        text: One line for people, without the topic.
    """

    topic: str
    kind: str
    text: str

    @property
    def is_harmless(self) -> bool:
        """Whether nodes cope with it so that nobody need know."""
        return self.kind in {'twice', 'order'}


@dataclass
class _Input:
    stamp_ns: int
    heard_s: float
    lost: int = 0


class InputWatch:
    """Looks at the stamps and arrivals of the topics that a node joins.

    An input is silent when nothing came for a time while another went on; when none goes on the
    sender of all is gone or paused, which is its own to tell. It is apart when its stamp and those
    of the others differ by more than a node should live with.

    Args:
        topics: The inputs.
        silent_s: Silence that is told, seconds of the wall clock. Chosen.
        apart_s: Difference of stamps that is told, seconds of the graph's clock. Chosen.
    """

    def __init__(
        self, topics: Iterable[str], *, silent_s: float = 1.0, apart_s: float = 0.3
    ) -> None:
        self._topics = tuple(topics)
        self._silent_s = silent_s
        self._apart_s = apart_s
        self._inputs: dict[str, _Input] = {}
        self._looked_s: float | None = None

    def heard(self, topic: str, stamp_ns: int, now_s: float) -> Trouble | None:
        """Take note of a message; return what is wrong with it, or None.

        Args:
            topic: One of the inputs.
            stamp_ns: Its stamp.
            now_s: The time now on a steady clock.
        """
        last = self._inputs.get(topic)
        if last is None:
            self._inputs[topic] = _Input(stamp_ns, now_s)
            return None
        before_ns, last.stamp_ns, last.heard_s = last.stamp_ns, stamp_ns, now_s
        trouble = self._apart(topic, stamp_ns, now_s)
        if trouble is None and stamp_ns == before_ns:
            return Trouble(topic=topic, kind='twice', text='a message came twice')
        if trouble is None and stamp_ns < before_ns:
            early_s = (before_ns - stamp_ns) / _NS_PER_S
            return Trouble(
                topic=topic, kind='order', text=f'out of order: {early_s:.2f} s before the last'
            )
        return trouble

    def _apart(self, topic: str, stamp_ns: int, now_s: float) -> Trouble | None:
        for other, seen in self._inputs.items():
            apart_s = (stamp_ns - seen.stamp_ns) / _NS_PER_S
            if other == topic or abs(apart_s) <= self._apart_s:
                continue
            if now_s - seen.heard_s > _RECENT_S:
                continue
            where = 'ahead of' if apart_s > 0 else 'behind'
            return Trouble(topic=topic, kind='apart', text=f'{abs(apart_s):.2f} s {where} {other}')
        return None

    def look(self, now_s: float, missing: Mapping[str, int] | None = None) -> list[Trouble]:
        """Return what is wrong now; to be called several times in a second.

        Args:
            now_s: The time now on a steady clock.
            missing: How often each input has been missing so far, where that is counted.
        """
        held_s = 0.0 if self._looked_s is None else now_s - self._looked_s
        self._looked_s = now_s
        if held_s > _HELD_S:
            for seen in self._inputs.values():
                seen.heard_s = now_s
            return [Trouble(topic='', kind='held', text=f'was held up for {held_s:.2f} s')]
        return [*self._silent(now_s), *self._lost(missing or {})]

    def _silent(self, now_s: float) -> list[Trouble]:
        ages_s = {topic: now_s - seen.heard_s for topic, seen in self._inputs.items()}
        if not any(age_s <= 0.5 * self._silent_s for age_s in ages_s.values()):
            return []
        return [
            Trouble(topic=topic, kind='silent', text=f'nothing for {age_s:.1f} s')
            for topic, age_s in ages_s.items()
            if age_s > self._silent_s
        ]

    def _lost(self, missing: Mapping[str, int]) -> list[Trouble]:
        troubles = []
        for topic, count in missing.items():
            seen = self._inputs.get(topic)
            if seen is not None and count - seen.lost >= _LOST:
                text = f'{count - seen.lost} messages were missing'
                troubles.append(Trouble(topic=topic, kind='lost', text=text))
                seen.lost = count
        return troubles
