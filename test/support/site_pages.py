"""Pages of the documentation site: those in `docs/`, and those made from other files."""

import base64
from collections.abc import Mapping
import importlib
import inspect
import io
import json
import os
from pathlib import Path
import posixpath
import re
from typing import Any

import yaml

from architecture import PACKAGES
from site_drawing import drawing_svg
from site_reference import command_sections, parameter_sections

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = ('ARCHITECTURE', 'CHANGELOG', 'CONTRIBUTING', 'REPRODUCTION', 'SECURITY')
_LINK = re.compile(r'(?<!!)\[([^\]]*)\]\((?![a-z]+:|#)([^)\s#]+)(#[^)]*)?\)')
_CODE = re.compile(r'(^```.*?^```$|`[^`\n]+`)', re.MULTILINE | re.DOTALL)
_FORMULA = re.compile(r'\${1,2}([^$]+)\${1,2}')
_FORMULA_PT = 12.5
_MERMAID = re.compile(r'^```mermaid\n.*?^```$', re.MULTILINE | re.DOTALL)
_PUBLIC_NAMES = Path(__file__).with_name('public_names.yaml')
"""Names that the reference describes, by package and module."""
_UNDRAWN = re.compile(r'\\big[lr]')  # sizes of brackets, which matplotlib does not know


def all_pages() -> dict[str, str]:
    """Return the text of every page, with the site's own links, by its path in the site."""
    docs = ROOT / 'docs'
    pages = {path.relative_to(docs).as_posix(): path.read_text() for path in docs.rglob('*.md')}
    pages |= {f'{name}.md': (ROOT / f'{name}.md').read_text() for name in DOCUMENTS}
    for path in sorted(docs.glob('notebooks/*.ipynb')):
        pages[f'notebooks/{path.stem}.md'] = notebook_page(path)
    pages['notebooks/README.md'] += _toctree(
        p.stem for p in sorted(docs.glob('notebooks/*.ipynb'))
    )
    pages['reference/commands.md'] += command_sections()
    pages['reference/parameters.md'] += parameter_sections()
    pages['reference/api/index.md'] += _toctree(PACKAGES)
    pages |= {f'reference/api/{package}.md': api_page(package) for package in PACKAGES}
    pages['how-to/gymnasium.md'] += gymnasium_section()
    return {name: site_text(name, text, set(pages)) for name, text in pages.items()}


def site_text(page: str, markdown: str, pages: set[str]) -> str:
    """Return a page with links that lead to other pages, and with formulas and packages drawn."""
    source = repository_path(page)
    markdown = _MERMAID.sub(lambda _: drawing_svg(), markdown)
    parts = _CODE.split(markdown)
    for index in range(0, len(parts), 2):
        text = _LINK.sub(lambda found: _link(found, page, source, pages), parts[index])
        if source.endswith('.ipynb'):
            text = _FORMULA.sub(lambda found: formula(found[1]), text)
        parts[index] = text
    return ''.join(parts)


def repository_path(page: str) -> str:
    """Return the file in the repository that a page of the site shows."""
    stem = page.removesuffix('.md')
    if stem in DOCUMENTS:
        return page
    notebook = f'docs/{stem}.ipynb'
    return notebook if (ROOT / notebook).is_file() else f'docs/{page}'


def notebook_page(path: Path) -> str:
    """Return a notebook, without running it, as Markdown."""
    cells = json.loads(path.read_text())['cells']
    title, *texts = [_cell(cell) for cell in cells]
    note = f'{{download}}`Download this notebook <{path.name}>` and {{download}}`exercises.py`'
    note += ' into one folder: run there, it draws its figures. [How to open it](README.md).'
    heading, _, rest = title.partition('\n')
    return '\n\n'.join([heading, note, rest, *texts]) + '\n'


def _cell(cell: Mapping[str, Any]) -> str:
    text = ''.join(cell['source'])
    return text if cell['cell_type'] == 'markdown' else f'```ipython\n{text}\n```'


def formula(tex: str) -> str:
    """Return a formula as an image within the page."""
    from matplotlib import mathtext, rc_context
    from matplotlib.font_manager import FontProperties

    file = io.BytesIO()
    shown = _UNDRAWN.sub('', tex).replace(r'\frac', r'\dfrac')
    with rc_context({'savefig.transparent': True}):
        mathtext.math_to_image(f'${shown}$', file, FontProperties(size=_FORMULA_PT), format='svg')
    data = base64.b64encode(file.getvalue()).decode()
    plain = re.sub(r'[\\"{}]', ' ', tex)
    return f'<img class="formula" alt="{plain}" src="data:image/svg+xml;base64,{data}">'


def api_page(package: str) -> str:
    """Return the page of a package's public names; Sphinx inserts their docstrings."""
    module = importlib.import_module(package)
    names = yaml.safe_load(_PUBLIC_NAMES.read_text()).get(
        package, {'': getattr(module, '__all__', [])}
    )
    homes = [(f'{package}.{place}'.rstrip('.'), name) for place, n in names.items() for name in n]
    lines, elsewhere = [], []
    for place, name in sorted(homes, key=lambda home: home[1]):
        value = getattr(importlib.import_module(place), name)
        home = getattr(value, '__module__', place) if hasattr(value, '__qualname__') else place
        owner = home.partition('.')[0]
        if owner == package:
            lines += [f'.. {_directive(value)}:: {home}.{name}', *_members(value), '']
        else:
            elsewhere.append(f'{{py:obj}}`{name} <{home}.{name}>`')
    parts = [f'# {package}', _rst(f'.. automodule:: {package}', '   :no-members:')]
    parts += [f'Also here: {", ".join(elsewhere)}.'] if elsewhere else []
    return '\n\n'.join([*parts, _rst(*lines)]) + '\n'


def gymnasium_section() -> str:
    """Return the description of the Gymnasium environment, from its docstring."""
    from goalreach_learning.gym_environment import GoalReachEnv

    text = inspect.getdoc(GoalReachEnv) or ''
    return '\n' + text[text.index('## ') :] + '\n'


def _rst(*lines: str) -> str:
    return '\n'.join(['```{eval-rst}', *lines, '```'])


def _directive(value: object) -> str:
    if not inspect.isclass(value):
        return 'autofunction' if callable(value) else 'autodata'
    return 'autoexception' if issubclass(value, Exception) else 'autoclass'


def _members(value: object) -> list[str]:
    return ['   :members:'] if inspect.isclass(value) else []


def _toctree(names: Any) -> str:  # noqa: ANN401 - any texts
    listed = '\n'.join(names)
    return f'\n```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```\n'


def _link(found: re.Match[str], page: str, source: str, pages: set[str]) -> str:
    """Return a link as the site needs it; what the site does not hold is named without a link."""
    text, target, anchor = found[1], found[2], found[3] or ''
    wanted = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
    inside = re.sub(r'\.ipynb$', '.md', wanted.removeprefix('docs/'))
    if inside in pages:
        return f'[{text}]({os.path.relpath(inside, posixpath.dirname(page) or ".")}{anchor})'
    return text if (ROOT / wanted).exists() else found[0]
