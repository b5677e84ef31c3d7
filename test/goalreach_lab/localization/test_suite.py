from pathlib import Path

import pytest

from goalreach_bringup.command import Command
from goalreach_lab.localization import suite
from goalreach_lab.localization.suite import Options, execute
from goalreach_msgs_py.errors import ConfigurationError


def options(*arguments: str) -> Options:
    _, parsed = Command.of_module(suite).parse('bench localization', arguments)
    assert isinstance(parsed, Options)
    return parsed


SMALL = (
    *('--bound-images', '40', '--labelled-images', '1', '--runs', '2', '--run-seconds', '6'),
    *('--kidnaps', '2', '--hours', '0.03', '--frames', '3', '--noise-robots', '1'),
)


def test_results_are_kept_and_written_with_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from goalreach_lab.localization import bound_study, long_drive_study

    monkeypatch.setattr(long_drive_study, 'FRAMES_PER_MINUTE', 60)
    monkeypatch.setattr(bound_study, '_COLUMNS', 3)
    monkeypatch.setattr(bound_study, '_ROWS', 4)
    arguments = (
        *('--part', 'bound', 'consistency', 'kidnap', 'speed', 'long', 'inputs', *SMALL),
        *('--results', str(tmp_path / 'kept')),
    )
    rows = execute(options(*arguments))
    assert rows
    document, figures = tmp_path / 'L.md', tmp_path / 'figures'
    again = execute(options(*arguments, '--as-it-is', '--out', str(document)))
    assert [row.to_json() for row in again] == [row.to_json() for row in rows]
    text = document.read_text(encoding='utf-8')
    assert '## One image against the Cramer-Rao bound' in text
    assert '(figures/localization_day.png)' in text
    assert '## Driving to the goal' not in text
    assert '| all black | searching: ' in text
    assert '$' not in text
    drawn = {path.name for path in figures.iterdir()}
    assert {'localization_bound.svg', 'localization_kidnap.png'} <= drawn


@pytest.mark.parametrize(
    ('arguments', 'name'),
    [(('--kidnaps', '0'), '--kidnaps'), (('--jobs', '0'), '--jobs'), (('--as-it-is',), '--as')],
)
def test_refuses_invalid_options(arguments: tuple[str, ...], name: str) -> None:
    with pytest.raises(ConfigurationError, match=name):
        options(*arguments)


def test_sizes_are_small_unless_given() -> None:
    assert options().size('kidnaps') == 60
    assert options('--full').size('kidnaps') == 2000
    assert options('--full', '--kidnaps', '7').size('kidnaps') == 7
