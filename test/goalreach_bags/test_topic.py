"""Offers of quality of service, and message definitions."""

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rosbags.interfaces import QosReliability

from goalreach_bags.topic import message_definition, offers_to_text, parse_offers
from goalreach_msgs_py.errors import GoalreachError
from small_bags import DEFAULT_OFFER

RELIABILITIES = st.sampled_from([one.name.lower() for one in QosReliability])


@given(st.integers(0, 2**31), st.integers(0, 10**9 - 1), RELIABILITIES)
def test_offers_survive_their_text(sec: int, nsec: int, reliability: str) -> None:
    offers = (
        {**DEFAULT_OFFER, 'deadline': {'sec': sec, 'nsec': nsec}, 'reliability': reliability},
        {**DEFAULT_OFFER, 'depth': 3},
    )

    assert parse_offers(offers_to_text(offers)) == offers


@pytest.mark.parametrize('text', ['', ']', 'a', '- a: b', '- 3'])
def test_offers_that_are_not_understood_are_none(text: str) -> None:
    assert parse_offers(text) == ()


def test_definition_holds_all_that_a_message_is_made_of() -> None:
    text = message_definition('geometry_msgs/msg/PoseStamped')

    headings = [line for line in text.splitlines() if line.startswith('MSG: ')]
    assert headings == [
        'MSG: geometry_msgs/Pose',
        'MSG: geometry_msgs/Point',
        'MSG: geometry_msgs/Quaternion',
        'MSG: std_msgs/Header',
        'MSG: builtin_interfaces/Time',
    ]


@pytest.mark.parametrize('name', ['sensor_msgs/msg/Nothing', 'nothing', 'std_srvs/srv/Trigger'])
def test_definition_that_is_not_installed_is_refused(name: str) -> None:
    with pytest.raises(GoalreachError, match=name.split('/', maxsplit=1)[0]):
        message_definition(name)
