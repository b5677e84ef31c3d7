import json
from pathlib import Path
from xml.etree import ElementTree as ET

import cv2
from matplotlib.figure import Figure
import pytest

from goalreach_bringup.cli import main
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import write_policy
from goalreach_msgs_py.regions import RegionMap

NAMES = (
    'figure_1_state_space',
    'figure_2_optimal_actions',
    'figure_3_crisp_paths',
    'figure_4_transition_areas',
    'figure_5_membership_functions',
    'figure_6_fuzzy_paths',
    'figure_7_full_chain_paths',
)


@pytest.fixture
def evaluation(tmp_path: Path) -> Path:
    file = tmp_path / 'evaluation.json'
    paths = [
        {'outcome': 'goal', 'trace': [[0.5, 2.5], [1.0, 2.0], [1.8, 1.5]]},
        {'outcome': 'bump', 'trace': [[0.5, 2.5], [0.225, 2.5]]},
        {'outcome': 'goal', 'trace': []},
    ]
    file.write_text(json.dumps({'mode': 'fuzzy', 'paths': paths}))
    return file


def test_draws_all_seven_as_svg_and_png(tmp_path: Path, evaluation: Path) -> None:
    out = tmp_path / 'new' / 'figures'
    assert main(['figures', '--evaluation', str(evaluation), '--out', str(out)]) == 0
    expected = {f'{name}.{ending}' for name in NAMES for ending in ('svg', 'png')}
    assert {file.name for file in out.iterdir()} == expected
    for name in NAMES:
        assert ET.parse(out / f'{name}.svg').getroot().tag.endswith('svg')  # noqa: S314
        image = cv2.imread(str(out / f'{name}.png'))
        assert image is not None
        assert min(image.shape[:2]) > 800


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> dict[str, Figure]:
    figures: dict[str, Figure] = {}

    def note(figure: Figure, _folder: Path, name: str, _endings: object) -> tuple[Path, ...]:
        figures[name] = figure
        return ()

    monkeypatch.setattr('goalreach_evaluation.figures.figure_file.write_figure', note)
    return figures


def test_without_an_evaluation_says_what_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], drawn: dict[str, Figure]
) -> None:
    assert main(['figures', '--out', str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert 'figure 7 (paths with all sensors) needs --evaluation' in text
    assert tuple(drawn) == NAMES[:6]


def test_drives_the_starts_itself_and_tells_the_seed(
    tmp_path: Path, drawn: dict[str, Figure]
) -> None:
    assert main(['figures', '--drive', '--seed', '7', '--out', str(tmp_path)]) == 0
    assert tuple(drawn) == NAMES
    assert 'seed 7' in drawn[NAMES[-1]].get_supxlabel()
    assert drawn[NAMES[1]].get_supxlabel() == 'Policy: learned with seed 7'
    legend = drawn[NAMES[-1]].axes[0].get_legend()
    assert legend is not None
    labels = [text.get_text() for text in legend.get_texts()]
    assert 'goal reached: 22 of 22' in labels


def test_writes_png_alone(tmp_path: Path) -> None:
    assert main(['figures', '--format', 'png', '--out', str(tmp_path)]) == 0
    assert {file.suffix for file in tmp_path.iterdir()} == {'.png'}


def test_the_policy_file_is_the_one_drawn(tmp_path: Path, drawn: dict[str, Figure]) -> None:
    file = tmp_path / 'p.json'
    write_policy(file, Policy.unlearned(RegionMap()))
    assert main(['figures', '--policy', str(file), '--out', str(tmp_path)]) == 0
    texts = [text.get_text() for text in drawn['figure_2_optimal_actions'].axes[0].texts]
    assert texts.count('not learned') == 8


def test_a_bad_file_is_one_line(
    tmp_path: Path, evaluation: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(['figures', '--policy', str(evaluation), '--out', str(tmp_path / 'f')]) == 2
    error = capsys.readouterr().err
    assert f'{evaluation}: format = None' in error
    assert not (tmp_path / 'f').exists()
