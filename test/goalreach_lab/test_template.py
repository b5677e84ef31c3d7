from pathlib import Path
import re

import pytest

from goalreach_lab.faults.kinds import KINDS
from goalreach_lab.template import render, table, write_document
from goalreach_msgs_py.files import read_yaml

_ROOT = Path(__file__).resolve().parents[2]
_LAB = _ROOT / 'lab' / 'goalreach_lab'

TEXT = """# $title

Costs $$5.

## First

${first} in all

## Second

$second
"""


def test_placeholders_are_replaced() -> None:
    text = render(TEXT, {'title': 'T', 'first': 3, 'second': '| a |'})
    assert text == '# T\n\nCosts $5.\n\n## First\n\n3 in all\n\n## Second\n\n| a |\n'


@pytest.mark.parametrize(('absent', 'left'), [('first', 'Second'), ('second', 'First')])
def test_a_section_that_was_not_measured_is_left_out(absent: str, left: str) -> None:
    text = render(TEXT, {'title': 'T', 'first': 1, 'second': 2, absent: None})
    assert [line for line in text.splitlines() if line.startswith('## ')] == [f'## {left}']


def test_a_placeholder_without_a_value_is_an_error() -> None:
    with pytest.raises(KeyError, match='second'):
        render(TEXT, {'title': 'T', 'first': 1})


def test_a_document_is_written(tmp_path: Path) -> None:
    template, document = tmp_path / 'template.md', tmp_path / 'document.md'
    template.write_text('# $title\n')
    write_document(document, template, {'title': 'ä'})
    assert document.read_text(encoding='utf-8') == '# ä\n'


def test_a_table_by_hand() -> None:
    assert table(('a', 'b'), [(1, 2)]) == '| a | b |\n| --- | --- |\n| 1 | 2 |'


_DOCUMENTS = {
    'docs/ABROAD.md': 'abroad/abroad.md',
    'docs/FAULTS.md': 'faults/faults.md',
    'docs/LEARNERS.md': 'learners/learners.md',
    'docs/LOCALIZATION.md': 'localization/localization.md',
    'docs/PERFORMANCE.md': 'speed/performance.md',
    'REPRODUCTION.md': 'reproduction/reproduction.md',
}
_LATER = {'docs/PERFORMANCE.md': {'## Readers that stop'}}
"""Sections that a document may lack until it is measured again."""


def _sections(text: str) -> dict[str, str]:
    """Return the sections of a text by their headings; what is before the first by ''."""
    first, *others = re.split(r'^(?=## )', text, flags=re.MULTILINE)
    return {'': first, **{one.partition('\n')[0]: one for one in others}}


def _holds(section: str, paragraph: str) -> bool:
    """Return whether a section holds a paragraph of a template, whatever its placeholders are."""
    pattern = re.sub(r'\\\$\w+', '.*?', re.escape(paragraph.replace('$$', '\0')))
    pattern = pattern.replace(re.escape('\0'), re.escape('$'))
    return re.search(rf'(?:^|\n\n){pattern}(?:\n\n|$)', section.strip(), re.DOTALL) is not None


@pytest.mark.parametrize('document', _DOCUMENTS)
def test_documents_hold_the_sections_and_the_text_of_their_templates(document: str) -> None:
    template = _sections((_LAB / _DOCUMENTS[document]).read_text(encoding='utf-8'))
    written = _sections((_ROOT / document).read_text(encoding='utf-8'))
    assert set(written) <= set(template)
    assert set(template) - set(written) <= _LATER.get(document, set())
    for heading, section in written.items():
        paragraphs = template[heading].strip().split('\n\n')
        assert [one for one in paragraphs if not _holds(section, one)] == []


def _rows_of(document: str) -> list[list[str]]:
    lines = (_ROOT / document).read_text(encoding='utf-8').splitlines()
    rows = [[cell.strip() for cell in line.split('|')[1:-1]] for line in lines if line[:1] == '|']
    return rows[2:]


def test_the_faults_of_the_document_are_the_kinds_that_are_injected() -> None:
    expected = {kind.name: kind.expected for kind in KINDS}
    rows = _rows_of('docs/FAULTS.md')
    assert [row[:2] for row in rows if expected.get(row[0]) != row[1]] == []
    assert len(rows) == len({row[0] for row in rows}) > 0


def test_the_worlds_of_the_document_are_those_of_its_cases() -> None:
    cases = read_yaml(_LAB / 'abroad' / 'cases.yaml')
    rows = _rows_of('docs/ABROAD.md')
    assert [row[:2] for row in rows if cases[row[0]]['world'] != row[1]] == []
    assert len(rows) == len({row[0] for row in rows}) > 0
