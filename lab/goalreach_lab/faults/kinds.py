"""The kinds of fault: what is done, the expected behaviour, and the words that report it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.files import read_yaml
from goalreach_msgs_py.topics import (
    BUMPERS,
    CMD_VEL,
    HEAD_COMMAND,
    IMAGE,
    JOINT_STATES,
    NODES,
    ODOM,
    POSE,
    STATE,
)

_RESTARTED: Final = 'the node is restarted; the robot stops meanwhile and continues its path'
_WAITS: Final = 'the robot stops while it lasts, then drives on'
_DRIVES_ON: Final = 'a warning in the log, nothing else'


@dataclass(frozen=True, kw_only=True)
class FaultKind:
    """One kind of fault.

    Attributes:
        name: A short description.
        act: Method of the injector that does it.
        target: Node, topic or parameter that it affects.
        amount: Seconds, a share, or a value of the parameter.
        duration_s: Duration, seconds of the graph's clock; 0 for an event.
        expected: Expected behaviour of the stack.
        report_pattern: Regular expression of the words that report it.
        ends_paths: Whether a path usually ends in it, by a bump or because it lasts so long: the
            recovery time counts nevertheless.
    """

    name: str
    act: str
    target: str = ''
    amount: float = 0.0
    duration_s: float = 2.0
    expected: str = _WAITS
    report_pattern: str
    ends_paths: bool = False


def _of_nodes() -> list[FaultKind]:
    kinds = []
    for node in NODES:
        held = rf'{node}.*(held up|too slow)|\({node}\): nothing|{node}.*did not answer'
        kinds += [
            FaultKind(
                name=f'{node} killed',
                act='kill',
                target=node,
                duration_s=0.0,
                expected=_RESTARTED,
                report_pattern=rf'{node}: error: was ended by SIGKILL',
            ),
            FaultKind(
                name=f'{node} stopped',
                act='stop',
                target=node,
                duration_s=1.5,
                report_pattern=held,
            ),
            FaultKind(
                name=f'{node} slowed', act='slow', target=node, duration_s=2.8, report_pattern=held
            ),
        ]
    return kinds


def _of_messages() -> list[FaultKind]:
    def on(topic: str, effect: str, amount: float, words: str, what: str) -> FaultKind:
        return FaultKind(
            name=f'{topic} {what}',
            act=effect,
            target=topic,
            amount=amount,
            expected=_DRIVES_ON if effect in {'twice', 'order'} else _WAITS,
            report_pattern=rf'{topic}.*({words})',
        )

    late, apart = 'behind|old is refused', 'behind|ahead|old is refused'
    return [
        *(on(t, 'late', 1.0, late, '1 s late') for t in (IMAGE, POSE, STATE, CMD_VEL)),
        *(on(t, 'twice', 1.0, 'twice', 'doubled') for t in (IMAGE, CMD_VEL)),
        *(on(t, 'order', 1.0, 'out of order', 'out of order') for t in (IMAGE, POSE)),
        on(IMAGE, 'lost', 0.8, 'missing|nothing for', 'lost, 4 of 5'),
        *(
            on(t, 'lost', 1.0, 'missing|nothing for', 'lost')
            for t in (JOINT_STATES, ODOM, STATE, BUMPERS, CMD_VEL, HEAD_COMMAND)
        ),
        *(on(t, 'shift', -5.0, apart, 'stamped 5 s in the past') for t in (IMAGE, POSE, CMD_VEL)),
        *(on(t, 'shift', 5.0, apart, 'stamped 5 s in the future') for t in (IMAGE, POSE, CMD_VEL)),
    ]


_OTHERS: Final = read_yaml(Path(__file__).with_name('kinds.yaml'))
"""Faults of LEDs, sensors, robot and surroundings."""

KINDS: Final = (*_of_nodes(), *_of_messages(), *(FaultKind(**one) for one in _OTHERS))
"""All kinds, in the order of the table."""


def choose_kinds(words: str) -> tuple[FaultKind, ...]:
    """Return the kinds whose name holds one of the words, separated by commas; all for none.

    Raises:
        ConfigurationError: No kind holds one of them.
    """
    wanted = [word.strip() for word in words.split(',') if word.strip()]
    if not wanted:
        return KINDS
    for word in wanted:
        if not any(word in kind.name for kind in KINDS):
            raise ConfigurationError('--kinds', word, 'a word of the name of a kind of fault')
    return tuple(kind for kind in KINDS if any(word in kind.name for word in wanted))
