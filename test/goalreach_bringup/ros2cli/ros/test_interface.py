from __future__ import annotations

import io
from pathlib import Path

import pytest

from goalreach_bringup.ros2cli.main import main

DEFINITION = """\
# What it is.
#
# More about it.

std_msgs/Header header  # when
int32 NONE=0            # a constant
Inner[] inner
    # an indented remark
string<=5 text "a b"
"""
INNER = """\
# Not shown with nested definitions.
float64 x  # metres
           # and more
uint8 y
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install a package of interfaces beside those of ROS."""
    index = tmp_path / 'share/ament_index/resource_index/rosidl_interfaces'
    index.mkdir(parents=True)
    (index / 'mine').write_text('msg/Outer.msg\nmsg/Outer.idl\nmsg/Inner.msg\naction/Go.action')
    (tmp_path / 'share/mine/msg').mkdir(parents=True)
    (tmp_path / 'share/mine/msg/Outer.msg').write_text(DEFINITION)
    (tmp_path / 'share/mine/msg/Inner.msg').write_text(INNER)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))


def output(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(['interface', *arguments]) == 0
    return capsys.readouterr().out


HEADER = 'std_msgs/Header header  # when\n\tbuiltin_interfaces/Time stamp\n\t\tint32 sec\n'
HEADER += '\t\tuint32 nanosec\n\tstring frame_id\n'


@pytest.mark.usefixtures('package')
def test_definition_is_shown_with_those_in_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert output(capsys, 'show', 'mine/msg/Outer') == (
        '# What it is.\n#\n# More about it.\n\n'
        f'{HEADER}int32 NONE=0            # a constant\n'
        'Inner[] inner\n\tfloat64 x  #\n\t           # and more\n\tuint8 y\n'
        '    # an indented remark\nstring<=5 text "a b"\n'
    )


@pytest.mark.usefixtures('package')
def test_comments_are_left_out_or_kept_everywhere(capsys: pytest.CaptureFixture[str]) -> None:
    bare = output(capsys, 'show', '--no-comments', 'mine/msg/Outer')
    assert bare.startswith('#\nstd_msgs/Header header  #\n\tbuiltin_interfaces/Time stamp\n')
    assert 'What it is' not in bare
    full = output(capsys, 'show', '--all-comments', 'mine/msg/Outer')
    assert '\t# Not shown with nested definitions.\n\tfloat64 x  # metres\n' in full


@pytest.mark.usefixtures('package')
def test_packages_and_their_types_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert output(capsys, 'package', 'mine') == 'mine/action/Go\nmine/msg/Inner\nmine/msg/Outer\n'
    assert output(capsys, 'package', '-m', 'mine') == 'mine/msg/Inner\nmine/msg/Outer\n'
    assert output(capsys, 'list', '-a') == 'Actions:\n    mine/action/Go\n'
    assert output(capsys, 'packages', '-a') == 'mine\n'
    packages = output(capsys, 'packages').splitlines()
    assert packages == sorted(packages)
    assert {'mine', 'std_srvs', 'geometry_msgs'} <= set(packages)
    listed = output(capsys, 'list')
    titles = [line for line in listed.splitlines() if not line.startswith(' ')]
    assert titles == ['Messages:', 'Services:', 'Actions:']
    assert '    std_srvs/srv/SetBool\n' in listed


def test_prototypes(capsys: pytest.CaptureFixture[str]) -> None:
    assert output(capsys, 'proto', 'geometry_msgs/msg/Vector3') == '"x: 0.0\ny: 0.0\nz: 0.0\n"\n'
    assert output(capsys, 'proto', '--no-quotes', 'std_srvs/srv/SetBool') == 'data: false\n\n'


def test_type_from_standard_input(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr('sys.stdin', io.StringIO('std_srvs/srv/SetBool\n'))
    assert output(capsys, 'show', '-', '--no-comments').splitlines()[1] == '---'


@pytest.mark.parametrize(
    ('arguments', 'line'),
    [
        (['show', 'String'], "Invalid name 'String'. Expected three parts separated by '/'"),
        (['show', 'nope/msg/Nope'], "Unknown package 'nope'"),
        (['show', 'std_msgs/msg/Nope'], "Could not find the interface 'std_msgs/msg/Nope'"),
        (['package', 'nope'], "Unknown package 'nope'"),
        (['proto', 'std_msgs/msg/Nope'], "The passed type is invalid: 'std_msgs/msg/Nope'"),
        (['proto', 'x'], "The passed type is invalid: 'x'"),
    ],
)
def test_mistakes_are_one_line(
    arguments: list[str], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(['interface', *arguments]) == 1
    assert capsys.readouterr() == ('', f'{line}\n')
