"""Standard ROS 2 parameter files."""

from pathlib import Path

import pytest

from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.parameter_file import (
    NodeParameters,
    merge_parameters,
    read_parameters,
    write_parameters,
)
from goalreach_msgs_py.topics import NODES

ONE, TWO, *REST = NODES


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / 'parameters.yaml'
    path.write_text(text)
    return path


def test_wildcards_come_first_and_nested_names_are_dotted(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        f'{ONE}: {{ros__parameters: {{rate: 2, noise: {{read: 1.5}}}}}}\n'
        '/**: {ros__parameters: {rate: 1, name: x}}\n',
    )
    assert read_parameters(path) == {
        ONE: {'rate': 2, 'name': 'x', 'noise.read': 1.5},
        **{node: {'rate': 1, 'name': 'x'} for node in (TWO, *REST)},
    }


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    parameters: NodeParameters = {
        ONE: {'a': 1, 'b.c': (1.0, 2.0), 'd': 'x', 'e': True},
        TWO: {'empty': ()},
    }
    path = tmp_path / 'written.yaml'
    write_parameters(path, parameters)
    back = read_parameters(path)
    assert back.pop(ONE) == {'a': 1, 'b.c': [1.0, 2.0], 'd': 'x', 'e': True}
    assert back == {node: {} for node in (TWO, *REST)}
    assert read_parameters(None) == {ONE: {}, **back}


def test_later_layers_win() -> None:
    merged = merge_parameters({'one': {'a': 1, 'b': 1}}, {'one': {'b': 2}}, {'two': {'c': 3}})
    assert merged == {'one': {'a': 1, 'b': 2}, 'two': {'c': 3}}


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('', 'must be a mapping'),
        ('[1, 2]', 'must be a mapping'),
        ('one: [', 'is not YAML at line 1'),
        ('nomad200: {a: 1}', 'nomad200: must hold a mapping ros__parameters'),
        (
            'three: {ros__parameters: {a: 1}}',
            'three: must be one of nomad200, ',
        ),
        ('nomad200: {ros__parameters: {a: }}', 'a: has no value'),
        ('nomad200: {ros__parameters: &a {b: *a}}', 'is nested too deeply'),
        ('nomad200: {ros__parameters: {a: 2020-01-01}}', 'a = datetime'),
        ('nomad200: {ros__parameters: {a: !!python/object:os.system {}}}', 'is not YAML'),
    ],
)
def test_refuses_with_file_and_field(tmp_path: Path, text: str, said: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(FileFormatError) as caught:
        read_parameters(path)
    assert str(caught.value).startswith(str(path))
    assert said in str(caught.value)


def test_refuses_binary_and_missing_files(tmp_path: Path) -> None:
    binary = tmp_path / 'binary'
    binary.write_bytes(bytes(range(256)))
    for path in (binary, tmp_path / 'missing', tmp_path):
        with pytest.raises(FileFormatError, match=str(path)):
            read_parameters(path)


def test_a_namespace_with_or_without_its_slash(tmp_path: Path) -> None:
    for name in ('robot1/nomad200', '/robot1/nomad200'):
        path = written(tmp_path, f'{name}: {{ros__parameters: {{seed: 5}}}}')
        assert read_parameters(path, 'robot1')['nomad200'] == {'seed': 5}
