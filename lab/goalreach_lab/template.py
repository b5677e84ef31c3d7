"""Documents from Markdown templates: text with `$placeholders` for measured values and tables."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
import re
from string import Template

from goalreach_msgs_py.files import write_text_atomically

_SECTION = re.compile(r'^(?=## )', re.MULTILINE)


def write_document(path: Path, template: Path, values: Mapping[str, object]) -> None:
    """Write a document.

    Args:
        path: The document.
        template: The template.
        values: By placeholder; see `render`.

    Raises:
        FileFormatError: The document cannot be written.
    """
    write_text_atomically(path, render(template.read_text(encoding='utf-8'), values))


def render(template: str, values: Mapping[str, object]) -> str:
    """Return the text of a template with its placeholders replaced (see `string.Template`).

    A section, from one `## ` heading to the next, that holds a placeholder whose value is None
    is left out: what it describes was not measured.

    Args:
        template: Markdown text. A dollar sign is written as `$$`.
        values: Value of every placeholder.

    Raises:
        KeyError: A placeholder has no value.
    """
    absent = {name for name, value in values.items() if value is None}
    sections = [one for one in _SECTION.split(template) if absent.isdisjoint(_placeholders(one))]
    return Template(''.join(sections)).substitute(values).rstrip() + '\n'


def _placeholders(text: str) -> set[str]:
    found = Template.pattern.finditer(text)
    return {match['named'] or match['braced'] for match in found}


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = ['| ' + ' | '.join(headings) + ' |', '|' + ' --- |' * len(headings)]
    lines += ['| ' + ' | '.join(str(cell) for cell in row) + ' |' for row in rows]
    return '\n'.join(lines)
