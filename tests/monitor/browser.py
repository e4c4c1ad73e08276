"""Real Chromium for tests of pages, and axe-core for what it finds there; else they are skipped, loudly."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

PATIENCE_MS = 180_000.0
"""How long a page may take to come, to have an element, or to take a click: on a busy machine long."""
AXE = Path(__file__).resolve().parents[2] / ".venv" / "axe" / "package" / "axe.min.js"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@contextmanager
def chromium(*further: str) -> Iterator[Any]:
    """Give a browser whose pages are waited for patiently, or skip the test and say why and what to do.

    Further options are those of Chromium's command line."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="NO BROWSER TEST: playwright is not installed"
    )
    path = os.environ.get("BUFFERSTAND_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip(
            "NO BROWSER TEST: no Chromium is installed, so nobody has looked at the monitor's page; "
            "apt install chromium (bash .ci/peers does it), or name one in BUFFERSTAND_CHROMIUM"
        )
    options = [*further, *(["--no-sandbox"] if os.geteuid() == 0 else [])]
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=options, timeout=PATIENCE_MS)
        fresh = browser.new_context

        def new_context(**settings: Any) -> Any:
            context = fresh(**settings)
            context.set_default_timeout(PATIENCE_MS)
            return context

        browser.new_context = new_context
        try:
            yield browser
        finally:
            browser.close()


def demand_axe() -> None:
    """Skip the test where nobody can judge, and say why and what to do."""
    if not AXE.exists():
        pytest.skip("NOT CHECKED FROM OUTSIDE: axe-core is not there; bash .ci/peers gets it from npm")


def faults(tab: Any) -> list[str]:
    """Return what axe-core finds on the page of a tab whose context bypasses the page's own policy."""
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    found = tab.evaluate(
        "rules => axe.run(document, {runOnly: {type: 'tag', values: rules}, resultTypes: ['violations']})",
        RULES,
    )
    return [
        f"{one['id']} ({one['impact']}): {one['help']}: {[node['html'][:200] for node in one['nodes'][:3]]}"
        for one in found["violations"]
    ]
