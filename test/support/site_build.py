"""Builds the documentation site: gathers its sources in a folder, and runs Sphinx over it."""

import argparse
from collections.abc import Mapping, Sequence
import os
from pathlib import Path
import shutil
import tempfile

from sphinx.cmd.build import main as run_sphinx

from site_pages import ROOT, all_pages

DOCS = ROOT / 'docs'
NAVIGATION: Mapping[str, Sequence[str]] = {
    'Tutorials': (
        'tutorials/first_drive',
        'tutorials/ten_lines',
        'notebooks/README',
    ),
    'How to': (
        'how-to/install',
        'how-to/parameters',
        'how-to/robot',
        'how-to/tags',
        'how-to/controller',
        'how-to/learner',
        'how-to/obstacles',
        'how-to/gymnasium',
        'Drive a real Nomad 200 <DRIVER>',
        'Record and replay bags <BAGS>',
        'Use the live page <DASHBOARD>',
        'Use RViz and Foxglove <RVIZ_FOXGLOVE>',
        'Secure a run <SECURITY>',
    ),
    'Reference': (
        'reference/commands',
        'reference/exit_status',
        'CONTRACT',
        'reference/parameters',
        'reference/environment',
        'reference/files',
        'Quality declaration <QUALITY_DECLARATION>',
        'reference/api/index',
    ),
    'Explanation': (
        'explanation/idea',
        'ARCHITECTURE',
        'The paper, measured <REPRODUCTION>',
        'What learners need <LEARNERS>',
        'Localization <LOCALIZATION>',
        'Faults <FAULTS>',
        'Driving in a MuJoCo world <ABROAD>',
        'Robustness <ROBUSTNESS>',
        'Performance <PERFORMANCE>',
    ),
    'Project': ('CONTRIBUTING', 'CHANGELOG'),
}


def main(arguments: Sequence[str]) -> int:
    """Build the site.

    Args:
        arguments: Of the command line.

    Returns:
        0 if it was built without a warning.
    """
    parser = argparse.ArgumentParser(
        prog='docs.py', description='Build the documentation as a site that needs no network.'
    )
    parser.add_argument('--out', metavar='DIR', type=Path, default=ROOT / 'site')
    out: Path = parser.parse_args(arguments).out
    if out.exists() and not _is_ours(out):
        parser.error(f'--out {out}: must be a new or empty folder, or one that holds this site')
    status = build(out)
    if status == 0:
        print(f'{out / "index.html"} is the first page')
    return status


def _is_ours(folder: Path) -> bool:
    """Tell whether a folder is empty or holds a site of Sphinx."""
    return folder.is_dir() and ((folder / '.buildinfo').is_file() or not any(folder.iterdir()))


def build(out: Path) -> int:
    """Build the site into a folder; return Sphinx's exit status, 1 after a warning."""
    with tempfile.TemporaryDirectory(prefix='goalreach-') as scratch:
        source = Path(scratch, 'source')
        write_sources(source)
        options = ['-q', '-W', '--keep-going', '-d', f'{scratch}/doctrees']
        return run_sphinx([*options, '-c', str(DOCS), str(source), os.fspath(out)])


def write_sources(folder: Path) -> None:
    """Write what the site is made from: pages with the site's links, figures, notebooks."""
    shutil.copytree(DOCS, folder, ignore=shutil.ignore_patterns('*.md', '*.py[co]', '__pycache__'))
    for name, text in all_pages().items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + (navigation() if name == 'index.md' else ''))


def navigation() -> str:
    """Return the table of contents, by section, as directives of Sphinx."""
    parts = []
    for caption, pages in NAVIGATION.items():
        listed = '\n'.join(pages)
        parts.append(f'\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{listed}\n```\n')
    return ''.join(parts)
