from __future__ import annotations

from pathlib import Path

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
        '__main__/msg/String',
    ],
)
def test_unknown_messages_are_refused_by_name(name: str) -> None:
    with pytest.raises(CommandError, match=r'^The passed message type is invalid') as caught:
        message_class(name)
    assert name in str(caught.value)


@pytest.mark.parametrize('name', ['intrusive/validate/Y', 'intrusive/msg/Y', 'intrusive/Y'])
def test_a_name_makes_no_other_module_run(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names come from bags and from whoever publishes."""
    (tmp_path / 'intrusive').mkdir()
    for module in ('__init__', 'validate'):
        (tmp_path / 'intrusive' / f'{module}.py').write_text(f'raise OSError({module!r})')
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(CommandError, match=r'^The passed message type is invalid'):
        message_class(name)


def test_unknown_services_and_messages_for_services_are_refused() -> None:
    for name in ('std_srvs/srv/Nope', 'std_msgs/msg/String'):
        with pytest.raises(CommandError, match=r'^The passed service type is invalid'):
            service_class(name)
