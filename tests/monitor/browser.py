"""Real Chromium for tests of pages: the system's own, driven by playwright; else they are skipped, loudly."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

PATIENCE_MS = 180_000.0
"""How long a page may take to come, to have an element, or to take a click: on a busy machine long."""
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@contextmanager
def chromium() -> Iterator[Any]:
    """Give a browser whose pages are waited for patiently, or skip the test and say why and what to do."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="NO BROWSER TEST: playwright is not installed"
    )
    path = os.environ.get("BUFFERSTAND_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip(
            "NO BROWSER TEST: no Chromium is installed, so nobody has looked at the monitor's page; "
            "apt install chromium (bash .ci/peers does it), or name one in BUFFERSTAND_CHROMIUM"
        )
    options = ["--no-sandbox"] if os.geteuid() == 0 else []
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
