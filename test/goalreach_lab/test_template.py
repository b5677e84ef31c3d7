from pathlib import Path

import pytest

from goalreach_lab.template import render, table, write_document

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


@pytest.mark.parametrize(
    ('template', 'document'),
    [
        ('abroad/abroad.md', 'docs/ABROAD.md'),
        ('faults/faults.md', 'docs/FAULTS.md'),
        ('learners/learners.md', 'docs/LEARNERS.md'),
        ('localization/localization.md', 'docs/LOCALIZATION.md'),
        ('reproduction/reproduction.md', 'REPRODUCTION.md'),
    ],
)
def test_documents_hold_the_text_of_their_templates(template: str, document: str) -> None:
    root = Path(__file__).resolve().parents[2]
    text = (root / document).read_text(encoding='utf-8')
    paragraphs = (root / 'lab' / 'goalreach_lab' / template).read_text(encoding='utf-8')
    fixed = [one for one in paragraphs.split('\n\n') if '$' not in one]
    assert [one for one in fixed if one.strip() not in text] == []
    assert len(fixed) > 3
