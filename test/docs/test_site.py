"""The documentation site: built without a warning, asks nothing from elsewhere, fits a phone."""

from __future__ import annotations

from collections.abc import Iterator
import fcntl
import os
from pathlib import Path
import re
import subprocess
import sys
from typing import Any

import pytest
import yaml

from browser import require_browser
from goalreach_bringup.cli import COMMANDS
from goalreach_lab.rigs.chromium import Page, open_page
from goalreach_msgs_py.parameters import parameter_infos

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PHONE_PX, LAPTOP_PX = 390, 1366
LOADED = re.compile(r'<(?:script|link|img|iframe|source|video|audio)\b[^>]*(?:src|href)="(.*?)"')
FOREIGN_CSS = re.compile(r'(?:url\(|@import)\s*["\']?\s*(?:https?:)?//')


@pytest.fixture(scope='module')
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site, once for all workers of pytest."""
    pytest.importorskip('sphinx')
    own = tmp_path_factory.getbasetemp()
    shared = own.parent if 'PYTEST_XDIST_WORKER' in os.environ else own
    out, done = shared / 'site', shared / 'site-done'
    with (shared / 'site-lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            build(out)
            done.touch()
    return out


def build(out: Path) -> None:
    command = [sys.executable, str(ROOT / 'scripts' / 'docs.py'), '--out', str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ''


@pytest.fixture(scope='module')
def pages(site: Path) -> list[Path]:
    return sorted(site.rglob('*.html'))


@pytest.fixture(scope='module')
def page(site: Path) -> Iterator[Page]:
    require_browser()
    with open_page((site / 'index.html').as_uri(), width=LAPTOP_PX) as page:
        yield page


def test_every_document_and_notebook_is_a_page(site: Path) -> None:
    documents = [path.relative_to(ROOT / 'docs') for path in ROOT.glob('docs/**/*.md')]
    notebooks = [path.relative_to(ROOT / 'docs') for path in ROOT.glob('docs/**/*.ipynb')]

    assert len(notebooks) >= 6
    for path in [*documents, *notebooks]:
        assert (site / path.with_suffix('.html')).is_file()
        assert path.suffix == '.md' or list(site.glob(f'_downloads/*/{path.name}'))


def test_a_folder_with_other_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'mine.txt').touch()
    command = [sys.executable, str(ROOT / 'scripts' / 'docs.py'), '--out', str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode == 2
    assert done.stderr.endswith('must be a new or empty folder, or one that holds this site\n')
    assert [path.name for path in tmp_path.iterdir()] == ['mine.txt']


def test_every_page_is_in_the_navigation(site: Path, pages: list[Path]) -> None:
    sidebar = (site / 'index.html').read_text()
    listed = {
        site / name for name in re.findall(r'class="reference internal" href="(.*?)"', sidebar)
    }

    absent = {page.name for page in set(pages) - listed}
    assert absent <= {'index.html', 'search.html'}


def test_pages_name_no_file_of_another_host(site: Path, pages: list[Path]) -> None:
    loaded = {url for page in pages for url in LOADED.findall(page.read_text())}
    styles = [path for path in site.rglob('*.css') if FOREIGN_CSS.search(path.read_text())]

    assert [url for url in loaded if re.match(r'(?:https?:)?//', url)] == []
    assert styles == []


def test_pages_ask_nothing_from_elsewhere_and_fit_a_phone(page: Page, pages: list[Path]) -> None:
    wide = []
    for path in pages:
        _resize(page, LAPTOP_PX)
        page.driver.get(path.as_uri())
        wide += [path.name] * _scrolls(page)
        _resize(page, PHONE_PX)
        wide += [f'{path.name} on a phone'] * _scrolls(page)

    assert wide == []
    assert page.hosts() == set()
    assert page.errors() == []


def test_a_word_is_found_without_a_server(site: Path, page: Page) -> None:
    _resize(page, LAPTOP_PX)
    page.driver.get((site / 'search.html').as_uri() + '?q=lockstep')

    assert page.until(lambda: page.driver.find_elements('css selector', '.search li a'))


def test_the_reference_names_every_command_and_parameter(site: Path) -> None:
    from goalreach_bringup.launch.plan import NODE_CONFIGS

    commands = (site / 'reference' / 'commands.html').read_text()
    parameters = (site / 'reference' / 'parameters.html').read_text()

    assert [name for name in COMMANDS if f'goalreach {name}' not in _text(commands)] == []
    assert all(
        option in _text(commands) for option in ('--policy NAME|FILE', '--recompute', '--paths N')
    )
    names = {
        name for classes in NODE_CONFIGS.values() for c in classes for name in parameter_infos(c)
    }
    assert {name for name in names if f'>{name}<' not in _text(parameters, tags=True)} == set()


def test_the_packages_show_their_public_names(site: Path) -> None:
    import goalreach

    listed = yaml.safe_load((ROOT / 'test' / 'support' / 'public_names.yaml').read_text())
    for package, names in {**listed, 'goalreach': {'': goalreach.__all__}}.items():
        text = _text((site / 'reference' / 'api' / f'{package}.html').read_text())
        assert [n for group in names.values() for n in group if n not in text] == []


def _text(html: str, *, tags: bool = False) -> str:
    html = html.replace('<span class="pre">', '').replace('</span>', '')
    html = html.replace('<code class="docutils literal notranslate">', '>').replace('</code>', '<')
    return html if tags else re.sub(r'<[^>]*>', '', html)


def _resize(page: Page, width_px: int) -> None:
    size: dict[str, Any] = {'width': width_px, 'height': 900, 'deviceScaleFactor': 1}
    page.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', {**size, 'mobile': False})


def _scrolls(page: Page) -> bool:
    """Tell whether the page is wider than the window."""
    script = 'return document.documentElement.scrollWidth > document.documentElement.clientWidth'
    return bool(page.driver.execute_script(script))
