"""What a release needs: one version, a changelog, a licence and a description in each package."""

from __future__ import annotations

from pathlib import Path
import re

from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import InvalidPackage, parse_package
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = sorted(path.parent for path in ROOT.glob('src/*/package.xml'))
_VERSION = re.search(r"^version = '(.*)'$", (ROOT / 'pyproject.toml').read_text(), re.MULTILINE)
VERSION = _VERSION[1] if _VERSION else ''


@pytest.mark.parametrize('folder', PACKAGES, ids=lambda path: path.name)
def test_a_package_can_be_released(folder: Path) -> None:
    warnings: list[str] = []
    try:
        package = parse_package(folder, warnings=warnings)
    except InvalidPackage as error:
        pytest.fail(str(error))
    assert warnings == []
    assert package.version == VERSION
    assert f'\nversion = {VERSION}\n' in (folder / 'setup.cfg').read_text()
    assert [str(each) for each in package.licenses] == ['Apache-2.0']
    assert [each.file for each in package.licenses] == ['LICENSE']
    assert (folder / 'LICENSE').read_bytes() == (ROOT / 'LICENSE').read_bytes()
    assert len(package.description.split()) > 3
    changelog = get_changelog_from_path(str(folder / 'CHANGELOG.rst'), folder.name)
    newest, date, notes = next(iter(changelog.foreach_version()))
    assert (newest, bool(date), bool(notes)) == (VERSION, True, True)


def test_the_version_is_semantic_and_changelogs_agree() -> None:
    assert re.fullmatch(r'[1-9]\d*\.\d+\.\d+', VERSION)
    assert f'## [{VERSION}]' in (ROOT / 'CHANGELOG.md').read_text()


@pytest.mark.parametrize(
    'path',
    re.findall(
        r'`((?:test|scripts)/\w[\w/]*(?:\.py)?)`',
        (ROOT / 'docs/QUALITY_DECLARATION.md').read_text(),
    ),
)
def test_the_evidence_of_the_quality_declaration_exists(path: str) -> None:
    assert (ROOT / path).exists()
