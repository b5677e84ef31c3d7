"""The kinds of fault: what is done, the expected behaviour, and the words that report it."""

from dataclasses import dataclass
from typing import Final

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.topics import (
    BUMPERS,
    CMD_VEL,
    CONTROLLER,
    HEAD_COMMAND,
    IMAGE,
    JOINT_STATES,
    LOCALIZER,
    NODES,
    ODOM,
    POSE,
    ROBOT,
    STATE,
)

_NO_LED = r'landmark_localizer.*(none of the expected LEDs|no LED was seen|LEDs are not where)'
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


def _of_leds() -> list[FaultKind]:
    return [
        FaultKind(name='all LEDs dark', act='dark', amount=3.0, report_pattern=_NO_LED),
        FaultKind(
            name='one LED dark',
            act='dark',
            amount=1.0,
            duration_s=3.0,
            expected='drives on by the other LEDs, or searches',
            report_pattern=rf'{LOCALIZER}.*LED \d|{_NO_LED}',
        ),
        FaultKind(
            name='a fourth light',
            act='light',
            duration_s=3.0,
            expected='drives on by the LEDs',
            report_pattern=rf'{LOCALIZER}.*no LED',
        ),
    ]


def _of_sensors() -> list[FaultKind]:
    return [
        FaultKind(
            name='camera frozen',
            act='parameter',
            target='faults.camera_frozen',
            report_pattern=rf'{LOCALIZER}.*image',
        ),
        FaultKind(
            name='odometry frozen',
            act='parameter',
            target='faults.odometry_frozen',
            expected='drives on by the LEDs, or stops while it lasts',
            report_pattern=rf'{LOCALIZER}.*odometry',
        ),
        FaultKind(
            name='a bumper stuck',
            act='bumper',
            duration_s=3.0,
            expected='no driving while it is pressed',
            report_pattern=rf'{CONTROLLER}.*bumper',
            ends_paths=True,
        ),
        FaultKind(
            name='carried by hand',
            act='carry',
            duration_s=0.0,
            expected='the pose is discarded at once and found again; drives on',
            report_pattern=rf'{LOCALIZER}.*(pose was (lost|replaced)|LEDs)',
        ),
        FaultKind(
            name='placed elsewhere',
            act='place',
            duration_s=0.0,
            expected='the pose is discarded at once and found again; drives on',
            report_pattern=rf'{LOCALIZER}.*odometry jumped',
        ),
    ]


def _of_surroundings() -> list[FaultKind]:
    return [
        FaultKind(name='clock stalled', act='stall', report_pattern=rf'{ROBOT}.*paused'),
        FaultKind(
            name='disk full for the recorder',
            act='disk',
            duration_s=0.0,
            expected='the recorder closes its bag and reports it; the run continues',
            report_pattern='recording stopped',
            ends_paths=True,
        ),
        FaultKind(
            name='a second stack in the domain',
            act='stack',
            duration_s=0.0,
            expected='the second is refused; the first continues',
            report_pattern='another graph runs there',
        ),
        FaultKind(
            name='a second publisher on /cmd_vel',
            act='second',
            amount=0.3,
            expected='the robot obeys neither until one has ended',
            report_pattern=rf'{ROBOT}.*nodes drive',
        ),
    ]


KINDS: Final = (*_of_nodes(), *_of_messages(), *_of_leds(), *_of_sensors(), *_of_surroundings())
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
