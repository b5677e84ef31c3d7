"""YAML that somebody made to hurt."""

import time

import pytest
import yaml

from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, one_line_repr
from goalreach_msgs_py.files import load_yaml


def test_plain_values_are_read() -> None:
    assert load_yaml('a: [1, 2.5, x]\nb: {c: true}') == {'a': [1, 2.5, 'x'], 'b': {'c': True}}


@pytest.mark.parametrize(
    'text',
    [
        '[' * 20_000,
        '{"a":' * 20_000,
        '9' * 200_000,
        '- ' * 3000,
        'a: 2001-99-99',
        '!!python/object/apply:os.system ["true"]',
        'a: [',
        '? {a: 1}\n: b',
    ],
)
def test_what_cannot_be_a_value_is_one_kind_of_error(text: str) -> None:
    with pytest.raises(yaml.YAMLError):
        load_yaml(text)


def test_a_value_that_is_huge_when_written_out_is_told_in_short() -> None:
    lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x]']
    lines += [f'a{k}: &a{k} [{", ".join([f"*a{k - 1}"] * 9)}]' for k in range(1, 12)]
    value = load_yaml('\n'.join(lines))
    began_s = time.process_time()
    assert len(str(ConfigurationError('field', value, 'small'))) < 2000
    assert time.process_time() - began_s < 2.0


def test_errors_are_one_line_whatever_is_in_the_value() -> None:
    assert '\n' not in str(ConfigurationError('a\nb', 'c\x1b[31m\nd', 'plain'))
    assert '\n' not in str(FileFormatError('file', 'two\nlines'))
    assert one_line_repr((0.1, 1.0, 0.0)) == '(0.1, 1.0, 0.0)'
