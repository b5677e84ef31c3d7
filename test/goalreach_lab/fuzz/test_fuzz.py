"""Every reader against bad input: one clear line or a valid value, nothing else."""

import contextlib
from dataclasses import asdict
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_lab.cli import main
from goalreach_lab.fuzz import valid_inputs
from goalreach_lab.fuzz.configurations import configuration_readers
from goalreach_lab.fuzz.guided import GUIDED, is_guided_installed, run_guided
from goalreach_lab.fuzz.mutation import mutate_bytes, mutate_value
from goalreach_lab.fuzz.reader import (
    InvalidAcceptedError,
    Reader,
    Tally,
    require_finite,
    try_inputs,
)
from goalreach_lab.fuzz.ros_messages import all_readers
from goalreach_lab.fuzz.suite import add_up
from goalreach_lab.fuzz.valid_inputs import bag_targets, document_targets
from goalreach_msgs_py.errors import GoalreachError

NAMES = [
    'policy file', 'arena file', 'arena file, read alone', 'noise file', 'parameter file',
    'evaluation file', 'bag, mcap', 'bag repair, mcap', 'bag, sqlite3', 'bag repair, sqlite3',
    'bag metadata, mcap', 'bag metadata, sqlite3', 'damaged MCAP files',
    'node parameters', 'parameters of a run', 'options of run', '--start', 'message: Odometry',
    'message: JointState', 'message: CameraInfo', 'message: Image',
    'message: LaserScan of bumpers', 'message: TwistStamped', 'message: pose',
    'message: landmarks', 'message: state', 'message: transition', 'message: Q-table',
    'localizer, from messages', 'state estimator, from messages', 'controller, from messages',
    'robot, from messages',
]  # fmt: skip


@pytest.fixture(scope='module')
def readers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Reader]:
    folder: Path = tmp_path_factory.mktemp('bad')
    return {reader.name: reader for reader in all_readers(folder)}


def test_every_reader_is_tried(readers: dict[str, Reader]) -> None:
    assert sorted(readers) == sorted(NAMES)


@pytest.mark.parametrize('name', NAMES)
@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(seed=st.integers(0, 2**32 - 1))
def test_bad_input_ends_in_one_clear_line(
    readers: dict[str, Reader], name: str, seed: int
) -> None:
    tally = try_inputs(readers[name], [seed])
    assert not tally.tracebacks
    assert not tally.hangs
    assert tally.refused + tally.accepted == 1


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_the_same_seed_breaks_the_same_way(seed: int) -> None:
    valid = {'a': [1.0, 2.0], 'b': {'c': 'text'}}

    def made() -> tuple[str, bytes]:
        rng = np.random.default_rng(seed)
        return repr(mutate_value(valid, rng)), mutate_bytes(b'some bytes of a file', rng)

    assert made() == made()
    assert valid == {'a': [1.0, 2.0], 'b': {'c': 'text'}}


def test_what_goes_wrong_is_counted() -> None:
    def attempt(rng: np.random.Generator) -> object:
        match int(rng.integers(4)):
            case 0:
                raise GoalreachError('one line')
            case 1:
                raise GoalreachError('two\nlines')
            case 2:
                raise KeyError('x')
        return 1.0

    tally = try_inputs(Reader(name='r', attempt=attempt), range(200))
    assert tally.inputs == 200
    assert tally.refused + tally.accepted < 200
    texts = {text for _, text in tally.tracebacks}
    assert any(text.startswith('not one clear line') for text in texts)
    assert any(text.startswith('KeyError') for text in texts)


def test_numbers_that_are_none_are_found_however_deep() -> None:
    require_finite({'a': [1.0, (2.0, {'b': np.zeros(3)})]})
    for bad in (float('nan'), [float('inf')], {'a': (1.0, np.array([np.nan]))}):
        with contextlib.suppress(InvalidAcceptedError):
            require_finite(bad)
            pytest.fail(f'{bad} was taken for finite')


def test_tallies_of_a_reader_add_up() -> None:
    one = asdict(Tally('a', inputs=2, refused=1, tracebacks=[(7, 'bad')]))
    other = asdict(Tally('a', inputs=3, refused=3, hangs=[8]))
    third = asdict(Tally('b', inputs=1, accepted=1))
    first, second = add_up([{'reader': 'a', 'first': 0, **one}, other, third])
    assert (first.name, first.inputs, first.refused, first.hangs) == ('a', 5, 4, [8])
    assert [text for _, text in first.tracebacks] == ['bad']
    assert (second.name, second.inputs) == ('b', 1)


def test_counts_are_kept_and_resumed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ['fuzz', '--readers=--start', '--results', str(tmp_path)]
    assert main([*words, '--examples', '30']) == 0
    kept = (tmp_path / 'fuzz.jsonl').read_text()
    assert main([*words, '--examples', '30']) == 0
    assert (tmp_path / 'fuzz.jsonl').read_text() == kept
    assert '30' in capsys.readouterr().out
    assert main([*words, '--examples', '30', '--seed', '1']) == 2  # of another seed


def test_every_target_of_guided_fuzzing_has_a_name_and_accepts_its_valid_file(
    tmp_path: Path,
) -> None:
    targets = [*document_targets(tmp_path), *bag_targets(tmp_path)]
    assert tuple(target.name for target in targets) == GUIDED
    for target in targets:
        assert target.take(target.encode(target.valid)) is not None


@pytest.mark.skipif(not is_guided_installed(), reason='atheris is not installed')
def test_atheris_feeds_a_reader(tmp_path: Path) -> None:
    tally = run_guided('noise file', runs=50, seed=1, folder=tmp_path)
    assert tally.inputs == 50
    assert tally.tracebacks == []


def test_a_traceback_of_one_use_of_a_bag_is_not_hidden_by_a_refusal_of_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: Path) -> None:
        raise TypeError('a defect')

    monkeypatch.setattr(valid_inputs, '_show_bag', fail)
    reader = {one.name: one for one in valid_inputs.bag_readers(tmp_path)}['bag metadata, mcap']
    tally = try_inputs(reader, range(10))
    assert [text.partition(' (')[0] for _, text in tally.tracebacks] == 10 * [
        'TypeError: a defect'
    ]


def test_options_are_refused_after_the_usage_and_in_one_line() -> None:
    (reader,) = (one for one in configuration_readers() if one.name == 'options of run')
    tally = try_inputs(reader, range(20))
    assert tally.refused > 0
    assert tally.tracebacks == []
