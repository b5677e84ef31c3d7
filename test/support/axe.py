"""Accessibility of a page, checked by axe-core in the browser that shows it."""

from __future__ import annotations

from importlib import resources
import os
from typing import Any

import pytest

from goalreach_lab.rigs.chromium import Page

_RUN = """
const done = arguments[arguments.length - 1];
axe.run(document).then(done);
"""
_FINDINGS = ('violations', 'incomplete')


def check(page: Page) -> dict[str, list[str]]:
    """Return what axe-core finds: rule and element of each violation and of each doubtful case."""
    try:
        package = resources.files('axe_core_python')
    except ModuleNotFoundError:
        if os.environ.get('CI') == 'true':
            raise
        pytest.skip('needs axe-core-python')
    source = (package / 'axe.min.js').read_text(encoding='utf-8')
    page.driver.execute_script(source)
    result: dict[str, Any] = page.driver.execute_async_script(_RUN)
    return {
        kind: [f'{rule["id"]}: {node["html"]}' for rule in result[kind] for node in rule['nodes']]
        for kind in _FINDINGS
    }


def emulate(page: Page, *, width: int, scheme: str) -> None:
    """Show the page at a width, light, dark, or in forced colours."""
    features = [
        {'name': 'prefers-color-scheme', 'value': 'dark' if scheme == 'dark' else 'light'},
        {'name': 'forced-colors', 'value': 'active' if scheme == 'forced' else 'none'},
    ]
    page.driver.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': features})
    size = {'width': width, 'height': 800, 'deviceScaleFactor': 1, 'mobile': False}
    page.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', size)
