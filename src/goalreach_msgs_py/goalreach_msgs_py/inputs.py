"""Detecting inputs of a node that are silent, lost, late or out of order."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

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
_ABSENT_S = 2.0
"""An input that has not come for this long, after another did or since the start, is reported:
longer than discovery usually takes. Chosen."""
ABSENT_KINDS = ('absent', 'waiting')
"""Kinds of problems of inputs that never came: while others did, and before any did."""
_BACK_S = 1.0
"""A stamp this much before the last is one of a clock that was set back, as in `alignment`."""
_REPORTED_LOSSES = 3
"""Fewer lost messages are not reported. Chosen."""


@dataclass(frozen=True, kw_only=True)
class InputProblem:
    """Something wrong with the inputs.

    Attributes:
        topic: The input, or an empty text for the node itself.
        kind: 'silent', 'apart', 'lost', 'duplicate', 'order', 'back', 'stalled' or `ABSENT_KINDS`.
        text: One line for people, without the topic.
    """

    topic: str
    kind: str
    text: str

    @property
    def is_harmless(self) -> bool:
        """Whether nodes lose nothing by it."""
        return self.kind in {'duplicate', 'order', 'waiting'}


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
        held: Inputs of which one message is enough: these may fall silent.
    """

    def __init__(self, required: Iterable[str] = (), held: Iterable[str] = ()) -> None:
        self._required, self._held = tuple(required), tuple(held)
        self._inputs: dict[str, _Input] = {}
        self._checked_s: float | None = None
        self._began_s: float | None = None

    def received(self, topic: str, stamp_ns: int, now_s: float) -> InputProblem | None:
        """Record a message at a time of a steady clock; return what is wrong with it, or None."""
        last = self._inputs.get(topic)
        if last is None:
            self._began_s = self._began_s if self._inputs else now_s
            self._inputs[topic] = _Input(stamp_ns, now_s)
            return None
        before_ns, last.stamp_ns, last.received_s = last.stamp_ns, stamp_ns, now_s
        problem = self._find_apart(topic, stamp_ns, now_s)
        if problem is not None or stamp_ns > before_ns:
            return problem
        if stamp_ns == before_ns:
            return InputProblem(topic=topic, kind='duplicate', text='a message came twice')
        early_s = (before_ns - stamp_ns) / _NS_PER_S
        if early_s > _BACK_S:
            text = f'its clock went back by {early_s:.2f} s: this node may have to be restarted'
            return InputProblem(topic=topic, kind='back', text=text)
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
        """Return what is wrong now, by a steady clock; to be called several times a second.

        `missing` says how often each input has been missing so far, where that is counted.
        """
        stalled_s = 0.0 if self._checked_s is None else now_s - self._checked_s
        self._checked_s = now_s
        self._began_s = now_s if self._began_s is None else self._began_s
        if stalled_s > _STALLED_S:
            for last in self._inputs.values():
                last.received_s = now_s
            return [InputProblem(topic='', kind='stalled', text=f'stalled for {stalled_s:.2f} s')]
        lost = self._find_lost(missing or {})
        return [*self._find_absent(now_s - self._began_s), *self._find_silent(now_s), *lost]

    def _find_absent(self, age_s: float) -> list[InputProblem]:
        absent = [topic for topic in self._required if topic not in self._inputs]
        if age_s <= _ABSENT_S:
            return []
        kind, text = ABSENT_KINDS[not self._inputs], f'never came in {age_s:.0f} s'
        return [InputProblem(topic=topic, kind=kind, text=text) for topic in absent]

    def _find_silent(self, now_s: float) -> list[InputProblem]:
        ages_s = {topic: now_s - last.received_s for topic, last in self._inputs.items()}
        if not any(age_s <= 0.5 * _SILENT_S for age_s in ages_s.values()):
            return []
        return [
            InputProblem(topic=topic, kind='silent', text=f'nothing for {age_s:.1f} s')
            for topic, age_s in ages_s.items()
            if age_s > _SILENT_S and topic not in self._held
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
