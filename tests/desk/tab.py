"""A tab of real Chromium on the desk, with what it asked for and what it complained about."""

from __future__ import annotations

import time
from typing import Any

import pytest

PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
WIDE = {"viewport": {"width": 1300, "height": 900}}
WAIT_S = 180.0
LISTEN = """
window.heard = [];
document.addEventListener("DOMContentLoaded", () => {
  const place = document.getElementById("said");
  const listener = new MutationObserver(() => window.heard.push(place.textContent));
  if (place) listener.observe(place, { childList: true });
});
"""
"""Keeps all that a page says: the next message may take the place of one before a test looks."""


class Tab:
    """A tab; its own complaints fail the test that asks for them."""

    def __init__(self, browser: Any, url: str, **options: Any) -> None:
        self.context = browser.new_context(**options)
        self.context.add_init_script(LISTEN)
        self.tab = self.context.new_page()
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self.tab.on("request", lambda request: self.requests.append(request.url))
        self.tab.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.tab.on(
            "console",
            lambda said: self.complaints.append(said.text) if said.type in ("error", "warning") else None,
        )
        self.go(url)

    def __enter__(self) -> Tab:
        return self

    def __exit__(self, *_: object) -> None:
        self.context.close()

    def go(self, url: str) -> None:
        """Open an address; with a token behind its #, wait until this has become a session.

        The page loads itself again then: whatever looked at the first one would lose it.
        """
        self.tab.goto(url)
        if "#" in url:
            self.wait(
                "!location.hash && document.body !== null && "
                "!document.body.innerText.includes('may only look on')"
            )

    def wait(self, condition: str, patience_s: float = WAIT_S) -> None:
        """Ask until it is so (the page's own policy forbids what playwright's way would do in it)."""
        end_s = time.monotonic() + patience_s
        while not self._is(condition):
            if time.monotonic() >= end_s:
                pytest.fail(f"not {condition}: {self.tab.inner_text('body')[:3000]}")
            self.tab.wait_for_timeout(50)

    def _is(self, condition: str) -> bool:
        try:
            return bool(self.tab.evaluate(condition))
        except Exception as error:
            if "context" not in str(error).lower() and "navigation" not in str(error).lower():
                raise
            return False

    def says(self, text: str) -> None:
        """Wait until the page has a text."""
        self.wait(f"document.body?.innerText.includes({text!r})")

    def has_said(self, text: str) -> None:
        """Wait until the page has said something since it was opened, whatever it says by now."""
        self.wait(f"window.heard?.some(said => said.includes({text!r}))")

    def width(self) -> int:
        """Return how wide the page is, with what is to be scrolled to."""
        return int(self.tab.evaluate("document.documentElement.scrollWidth"))
