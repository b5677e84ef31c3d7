from __future__ import annotations

import pytest

from goalreach_bringup.ros2cli.main import main, make_parser

VERBS = {
    'node': 'info list',
    'param': 'dump get list set',
    'service': 'call list',
    'topic': 'echo hz info list pub',
}


def test_without_a_command_it_tells_what_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    out = capsys.readouterr().out
    assert out.startswith('usage: ros2 ')
    assert all(name in out for name in VERBS)
    assert 'Differences from ros2cli 0.32: ' in out
    with pytest.raises(SystemExit):
        main(['topic', '--help'])
    assert 'Differences from ros2cli 0.32: ' in capsys.readouterr().out


@pytest.mark.parametrize(
    'arguments',
    [
        [],
        ['topic'],
        *([command, verb] for command, verbs in VERBS.items() for verb in verbs.split()),
    ],
)
def test_each_level_has_its_help(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([*arguments, '--help'])
    assert caught.value.code == 0
    assert capsys.readouterr().out.startswith(' '.join(['usage: ros2', *arguments]))


@pytest.mark.parametrize(
    'arguments',
    [
        ['tpoic'],
        ['topic', 'lits'],
        ['topic', 'info'],
        ['node'],
        *(['topic', verb, 'a-b'] for verb in ('info', 'echo', 'hz')),
        ['topic', 'pub', '/a//b', 'std_msgs/msg/Bool'],
        ['topic', 'pub', '/a', 'std_msgs/msg/Bool', '-1', '-t', '2'],
        ['topic', 'pub', '/a', 'std_msgs/msg/Bool', '-r', 'nan'],
        ['topic', 'hz', '/a', '-w', '0'],
        ['topic', 'echo', '/a', '-l', '-1'],
        ['topic', 'echo', '/a', '-l', '1.5'],
        ['service', 'call', '', 'std_srvs/srv/Trigger'],
    ],
)
def test_wrong_words_end_with_status_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert 'error: ' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('option', 'text', 'wanted'),
    [
        ('-r', 'nan', 'positive number'),
        ('-r', 'inf', 'positive number'),
        ('-r', '0', 'positive number'),
        ('-r', 'fast', 'positive number'),
        ('-t', '0', 'positive integer'),
        ('-t', '1.5', 'positive integer'),
    ],
)
def test_a_number_that_is_refused_is_told_what_it_must_be(
    option: str, text: str, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(['topic', 'pub', '/a', 'std_msgs/msg/Bool', option, text])
    assert f'value must be a {wanted}' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('arguments', 'name', 'value'),
    [
        ('topic list', 'show_types', False),
        ('topic list -t', 'show_types', True),
        ('topic echo /a -l 0', 'truncate_length', 0),
        ('topic hz /a -w 1', 'window', 1),
        ('topic pub /a std_msgs/msg/Bool -r 1e-300', 'rate', 1e-300),
    ],
)
def test_options_are_read(arguments: str, name: str, value: object) -> None:
    words = arguments.split()
    assert getattr(make_parser(words).parse_args(words), name) == value


@pytest.mark.parametrize(
    ('arguments', 'line'),
    [
        (['topic', 'pub', '/a', 'std_msgs/msg/Nope'], 'The passed message type is invalid'),
        (['topic', 'pub', '/a', 'std_msgs/msg/Bool', '[1]'], 'The passed value needs to be a '),
        (['topic', 'pub', '/a', 'std_msgs/msg/Bool', '{data: 2}'], 'Failed to populate field: '),
        (['service', 'call', '/a', 'std_msgs/msg/Bool'], 'The passed service type is invalid'),
        (['topic', 'echo', '/a', '--field', '.'], "Invalid field value '.'"),
    ],
)
def test_mistakes_are_one_line_and_nothing_else(
    arguments: list[str], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 1
    out, error = capsys.readouterr()
    assert out == ''
    assert error.startswith(line)
    assert error.count('\n') == 1
