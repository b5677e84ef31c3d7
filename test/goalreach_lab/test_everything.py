"""All studies of the documents: their commands, and how they go on where they were interrupted."""

from pathlib import Path

import pytest

from goalreach_lab import everything
from goalreach_lab.cli import command, main
from goalreach_msgs_py.files import read_yaml

_STUDIES = read_yaml(Path(everything.__file__).with_name('everything.yaml'))
_QUICK = """
met: {hours: 0, words: 'all --as-it-is --results {results}'}
failed: {hours: 0, words: 'fuzz --examples none'}
"""


def test_the_words_of_every_study_are_understood() -> None:
    bench = command()
    for name, study in _STUDIES.items():
        words = study['words'].format(results=f'results/{name}').split()
        chosen, options = bench.parse('goalreach bench', words)
        assert chosen.execute is not None
        assert getattr(options, 'out', None) is None or options.out.exists()


def test_it_goes_on_where_it_was_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    studies = tmp_path / 'studies.yaml'
    studies.write_text(_QUICK)
    monkeypatch.setattr(everything, '_STUDIES', studies)
    results = tmp_path / 'results'
    assert main(['all', '--results', str(results), '--study', 'met']) == 0
    assert (results / 'met.status').read_text().startswith('0 ')
    assert 'left: about' in (results / 'met.log').read_text()
    (results / 'failed').mkdir()
    assert main(['all', '--results', str(results), '--study', 'failed']) == 2
    assert '--resume' in capsys.readouterr().err
    (results / 'met.log').write_text('')
    assert main(['all', '--results', str(results), '--resume']) == 2
    assert 'failed.log' in capsys.readouterr().err
    assert '--examples' in (results / 'failed.log').read_text()
    assert not (results / 'failed.status').exists()
    assert (results / 'met.log').read_text() == ''
    studies.write_text(_QUICK.replace('--as-it-is', '--as-it-is --study abroad'))
    assert main(['all', '--results', str(results), '--resume', '--study', 'met']) == 0
    assert 'left: about 2 h' in (results / 'met.log').read_text()


def test_a_study_that_does_not_exist_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['all', '--study', 'x']) == 2
    assert capsys.readouterr().err.startswith("goalreach bench: --study = 'x': must be one of ")
