"""The notebooks run, and the checks of their exercises tell right answers from wrong ones."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import re
import subprocess
from typing import Any

import psutil
import pytest
import yaml

import graphs

pytest.importorskip('ipykernel')
nbclient = pytest.importorskip('nbclient')
nbformat = pytest.importorskip('nbformat')

FOLDER = Path(__file__).parents[2] / 'docs' / 'notebooks'
NAMES = sorted(path.stem for path in FOLDER.glob('*.ipynb'))
SOLUTIONS = yaml.safe_load((Path(__file__).parent / 'solutions.yaml').read_text())
GRAPH = '5_the_live_graph'
SAID = {
    '6_your_own': [r'learned\.json: after 30 paths', r'[1-9]\d? of 22 starts lead to the goal']
}
SEGMENTS = '/dev/shm/fastrtps_'  # noqa: S108 - where Fast DDS keeps its shared memory


def read(name: str) -> Any:  # noqa: ANN401 - a notebook
    return nbformat.read(FOLDER / f'{name}.ipynb', as_version=4)


def tagged(notebook: Any, tag: str) -> int:  # noqa: ANN401 - a notebook
    """Return the index of the only cell with a tag."""
    (index,) = (i for i, c in enumerate(notebook.cells) if tag in c.metadata.get('tags', []))
    return index


@contextmanager
def kernel(notebook: Any, home: Path) -> Iterator[Any]:  # noqa: ANN401 - a client of nbclient
    """Give a client with a fresh kernel of this Python, in the folder of the notebooks."""
    environment = {**graphs.graph_environment(graphs.fresh_domain(), home), 'TMPDIR': str(home)}
    own = {'IPYTHONDIR': str(home), 'JUPYTER_PREFER_ENV_PATH': '1'}
    with pytest.MonkeyPatch.context() as patch:
        for key, value in own.items():
            patch.setenv(key, value)
        where = {'metadata': {'path': str(FOLDER)}}
        client = nbclient.NotebookClient(notebook, timeout=100, resources=where)
        with client.setup_kernel(env={**os.environ, **environment}):
            yield client


def printed(cell: Any) -> str:  # noqa: ANN401 - a cell
    return ''.join(o.text for o in cell.outputs if o.output_type == 'stream')


def answered(client: Any, number: int, answer: str) -> str:  # noqa: ANN401 - a client
    """Replace the answer to an exercise; return what its check prints."""
    for tag in ('exercise', 'check'):
        index = tagged(client.nb, f'{tag}-{number}')
        cell = client.nb.cells[index]
        cell.source = answer if tag == 'exercise' else cell.source
        client.execute_cell(cell, index)
    return printed(client.nb.cells[index])


def test_the_course_has_six_notebooks() -> None:
    assert sorted(SOLUTIONS) == NAMES
    assert [int(name[0]) for name in NAMES] == [1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize('name', NAMES)
def test_a_notebook_is_stored_without_outputs(name: str) -> None:
    # As git has it: a reader's own copy may hold the figures of a run.
    command = ['git', 'show', f':./{name}.ipynb']
    stored = subprocess.run(command, cwd=FOLDER, capture_output=True, text=True, check=True)
    notebook = nbformat.reads(stored.stdout, as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == 'code']
    assert all(not cell.outputs and cell.execution_count is None for cell in code)
    assert all(cell.source.count('\n') < 45 for cell in code)
    assert set(notebook.metadata) == {'kernelspec', 'language_info'}
    assert notebook.cells[0].source.startswith(f'# {name[0]}. ')


@pytest.mark.parametrize('name', NAMES)
def test_a_notebook_links_to_files_that_exist(name: str) -> None:
    text = '\n'.join(cell.source for cell in read(name).cells if cell.cell_type == 'markdown')
    links = re.findall(r'\]\((?!https?:)([^)#]+)', text)
    assert links
    assert not [link for link in links if not (FOLDER / link).exists()]


@pytest.mark.parametrize(
    'name',
    [pytest.param(n, marks=pytest.mark.graph if n == GRAPH else pytest.mark.slow) for n in NAMES],
)
def test_a_notebook_runs_and_its_checks_can_fail(name: str, tmp_path: Path) -> None:
    with kernel(read(name), tmp_path) as client:
        cells = client.nb.cells
        for index, cell in enumerate(cells):
            client.execute_cell(cell, index)
        outputs = [o for cell in cells for o in cell.get('outputs', [])]
        text = ''.join(o.text for o in outputs if o.output_type == 'stream')
        assert [said for said in SAID.get(name, []) if not re.search(said, text)] == []
        assert sum('image/png' in output.get('data', {}) for output in outputs) >= 4
        for number, answers in SOLUTIONS[name].items():
            delivered = printed(cells[tagged(client.nb, f'check-{number}')])
            wrong, right = (answered(client, number, answers[k]) for k in ('wrong', 'right'))
            assert delivered.startswith(f'Exercise {number}: not yet.')
            assert wrong.startswith(f'Exercise {number}: not yet.')
            assert right == f'Exercise {number}: right\n'


LEAVE = """
    family = [psutil.Process(), *psutil.Process().children(recursive=True)]
    maps = {m.path for process in family for m in process.memory_maps()}
    print(*(path for path in maps if '/dev/shm/' in path))
    raise RuntimeError(f'{len(family)} processes')
"""


@pytest.mark.graph
def test_a_failing_cell_leaves_nothing_running(tmp_path: Path) -> None:
    notebook = read(GRAPH)
    (start,) = (i for i, c in enumerate(notebook.cells) if 'program(*run)' in c.source)
    before, after = notebook.cells[start].source.split('    listen(node, process)\n')
    notebook.cells[start].source = before + LEAVE + after
    with kernel(notebook, tmp_path) as client:
        for index, cell in enumerate(notebook.cells[:start]):
            client.execute_cell(cell, index)
        with pytest.raises(nbclient.exceptions.CellExecutionError, match=r'[6-9] processes'):
            client.execute_cell(notebook.cells[start], start)
        assert not psutil.Process(client.km.provisioner.pid).children(recursive=True)
        words = printed(client.nb.cells[start]).split()
        files = {Path(word) for word in words if word.startswith(SEGMENTS)}
    assert files
    assert not graphs.abandoned(files)
