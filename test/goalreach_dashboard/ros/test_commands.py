import asyncio
from collections.abc import Mapping
import math
from unittest.mock import Mock

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_dashboard.ros.commands import GraphCommands, checked_pose
from goalreach_dashboard.state import PageState
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import CommandError, ConfigurationError
from goalreach_msgs_py.topics import ESTIMATOR, LOCALIZER, ROBOT

ARENA = Arena()
_anything = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=6,
)


@pytest.mark.parametrize(
    ('heading_deg', 'heading_rad'),
    [(-90, -math.pi / 2), (-180, math.pi), (270, -math.pi / 2), (45.0, math.pi / 4)],
)
def test_a_pose_is_given_in_metres_and_degrees(heading_deg: float, heading_rad: float) -> None:
    pose = checked_pose([1, 4.0, heading_deg], ARENA)
    assert (pose.x_m, pose.y_m) == (1.0, 4.0)
    assert pose.heading_rad == pytest.approx(heading_rad)


@given(_anything)
def test_whatever_a_browser_sends_is_refused_or_a_pose_on_the_floor(sent: object) -> None:
    try:
        pose = checked_pose(sent, ARENA)
    except ConfigurationError:
        return
    assert ARENA.is_free(pose.x_m, pose.y_m)


class Commands(GraphCommands):
    """Commands to nodes that accept every value, but one that is absent.

    Attributes:
        sent: The parameters set, by name.
    """

    def __init__(self, absent: str = '') -> None:
        def create_client(_: object, name: str) -> Mock:
            ready = name.partition('/')[0] != absent
            return Mock(srv_name=f'/{name}', service_is_ready=lambda: ready)

        super().__init__(Mock(create_client=create_client), PageState(arena=ARENA))
        self.sent: dict[str, object] = {}

    async def _set(self, _node: str, values: Mapping[str, object]) -> None:
        self.sent.update(values)


@pytest.mark.parametrize(
    ('name', 'wrong'),
    [
        *(('speed', wrong) for wrong in (None, '1', True, math.nan, math.inf, [1.0])),
        *(
            (name, wrong)
            for name in ('mode', 'noise')
            for wrong in ('bold', '', None, 3, ['none'])
        ),
    ],
)
def test_a_bad_value_is_refused_and_nothing_sent(name: str, wrong: object) -> None:
    commands = Commands()
    with pytest.raises(ConfigurationError, match=f'^{name} = '):
        asyncio.run(commands.execute(name, wrong))
    assert not commands.sent


@pytest.mark.parametrize(
    ('name', 'value', 'absent'),
    [
        ('noise', 'none', LOCALIZER),
        ('goal', [1.778, 0.5], ESTIMATOR),
        ('goal', [1.778, 0.5], ROBOT),
    ],
)
def test_where_a_node_is_absent_no_other_is_changed(name: str, value: object, absent: str) -> None:
    commands = Commands(absent)
    with pytest.raises(CommandError, match=f'^/{absent}/.* is not available'):
        asyncio.run(commands.execute(name, value))
    assert not commands.sent
    assert asyncio.run(Commands().execute(name, value)).startswith(f'{name}: ')


def test_a_good_value_is_sent_a_speed_always_as_a_double() -> None:
    """A parameter of type double refuses an integer."""
    commands = Commands()
    for name, value in (('speed', 2), ('mode', 'crisp'), ('noise', 'none')):
        assert asyncio.run(commands.execute(name, value)).startswith(f'{name}: {value}')
    assert type(commands.sent['speed']) is float
    assert commands.sent['mode'] == 'crisp'
    assert commands.sent['noise.read_noise_dn'] == 0.0


def test_a_place_in_the_wall_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='on the free floor'):
        checked_pose([0.1, 2.0, 0.0], ARENA)
