from __future__ import annotations

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool

from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import full_type_name, message_class, service_class


def test_long_and_short_names() -> None:
    assert message_class('std_msgs/msg/String') is message_class('std_msgs/String') is String
    assert service_class('std_srvs/srv/SetBool') is service_class('std_srvs/SetBool') is SetBool
    assert full_type_name('std_srvs/SetBool', 'srv') == 'std_srvs/srv/SetBool'


@pytest.mark.parametrize(
    'name',
    [
        'String',
        'std_msgs/msg/Nope',
        'nope/msg/String',
        'std_msgs/msg/String/x',
        '/msg/',
        'os/path',
    ],
)
def test_unknown_messages_are_refused_by_name(name: str) -> None:
    with pytest.raises(CommandError, match=r'^The passed message type is invalid') as caught:
        message_class(name)
    assert name in str(caught.value)


def test_unknown_services_and_messages_for_services_are_refused() -> None:
    for name in ('std_srvs/srv/Nope', 'std_msgs/msg/String'):
        with pytest.raises(CommandError, match=r'^The passed service type is invalid'):
            service_class(name)
