"""Offers of quality of service, and message definitions."""

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rosbags.interfaces import QosReliability

from goalreach_bags.topic import merge_topics, message_definition, offers_to_text, parse_offers
from goalreach_msgs_py.errors import GoalreachError
from small_bags import DEFAULT_OFFER, string_topic

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


@pytest.mark.parametrize(
    ('depth', 'understood'),
    [(0, True), (1, True), (2**63 - 1, True), (2**63, False), (-1, False), (1.5, False)],
)
def test_numbers_of_an_offer_fit_those_of_a_publisher(depth: float, understood: object) -> None:
    offers = ({**DEFAULT_OFFER, 'depth': depth},)
    assert (parse_offers([*offers]) == offers) is understood
    assert bool(parse_offers([*offers])) is understood


def test_later_descriptions_of_a_topic_add_what_the_first_lacks() -> None:
    bare = string_topic(type_hash='', offers=())
    first, later = string_topic(type_hash='first'), string_topic(type_hash='later', offers=())
    assert merge_topics([bare, first]) == {'/text': first}
    assert merge_topics([first, later]) == {'/text': first}


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
    assert text.splitlines().count(80 * '=') == len(headings)


@pytest.mark.parametrize(
    'name',
    [
        'sensor_msgs/msg/Nothing',
        'nothing',
        'std_srvs/srv/Trigger',
        'std_msgs/Bool',
        'std_msgs/srv/Bool',
        'std_msgs/action/Bool',
        'std_msgs/msg/Bool/more',
    ],
)
def test_definition_that_is_not_installed_is_refused(name: str) -> None:
    with pytest.raises(GoalreachError, match=name.split('/', maxsplit=1)[0]):
        message_definition(name)
