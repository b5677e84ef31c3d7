"""The ten lines of README run, and README shows them as they are."""

import ast
from pathlib import Path
import re
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / 'examples' / 'ten_lines.py'


def test_readme_shows_the_example() -> None:
    text = EXAMPLE.read_text()
    (block,) = re.findall(
        r'^```python\n(.*?)^```', (ROOT / 'README.md').read_text(), re.MULTILINE | re.DOTALL
    )
    assert text == f'"""{ast.get_docstring(ast.parse(text))}"""\n\n{block}'
    assert len([line for line in block.splitlines() if line.strip()]) <= 10


@pytest.mark.slow
def test_the_example_runs(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLE)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=100,
        check=True,
    )
    first, *frames, last = done.stdout.splitlines()
    assert first == '100 % of 22 paths reached the goal'
    assert len(frames) > 100
    assert all(re.fullmatch(r' ?\d+\.\d\d s: at [\d., ]+ m, driving .* m/s', f) for f in frames)
    assert last == '14 figures in figures'
    assert len(list((tmp_path / 'figures').iterdir())) == 14
