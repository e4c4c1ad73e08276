"""The twin on the page in real Chromium: its band is drawn, and what it says is shown as text."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from bufferstand.daq.monitor.campaign_view import TWIN_NAME
from tests.monitor.browser import chromium
from tests.monitor.served import HACK, TOKENS, running, served
from tests.monitor.test_browser import Tab

GREEN = """() => {
  const canvas = document.querySelector("#loop-chart canvas"), c = canvas.getContext("2d");
  const all = c.getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let i = 0; i < all.length; i += 4)
    if (all[i + 1] > all[i] + 20 && all[i + 1] > all[i + 2] + 3 && all[i + 3] > 40) count++;
  return count;
}"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as it:
        yield it


def document(alarms: list[dict[str, Any]]) -> str:
    """What the twin writes of step 1: a loop of 5 to 15 mm in a broad band."""
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    stroke = 10.0 - 5.0 * np.cos(turn)
    force = 20.0 + 4.0 * stroke + 5.0 * np.sin(turn)
    band = {"s": stroke.tolist(), "low": (force - 10.0).tolist(), "high": (force + 10.0).tolist()}
    told = {"schema": "bufferstand/twin/1", "model": HACK, "step": 1, "judged": 7, "band": band}
    return json.dumps({**told, "cycles": [], "alarms": alarms})


@pytest.mark.slow
def test_the_band_is_drawn_and_alarms_are_said(
    tmp_path_factory: pytest.TempPathFactory, browser: Any
) -> None:
    with (
        running(tmp_path_factory.mktemp("twin")) as going,
        served(going.case.out) as page,
        Tab(browser, f"{page.origin}/#{TOKENS.view}") as tab,
    ):
        tab.drawn()
        assert tab.tab.evaluate("document.body.dataset.band") == "0"
        before = tab.tab.evaluate(GREEN)
        (going.case.out / TWIN_NAME).write_text(document([]), encoding="utf-8")
        tab.wait("document.body.dataset.band === '60'")
        assert tab.tab.evaluate(GREEN) > before + 500
        assert "7 cycles compared with" in tab.tab.inner_text("#twin")
        said = [{"step": 1, "sentence": f"loss +18 % ± 2 % {HACK}", "cycle": 7}]
        (going.case.out / TWIN_NAME).write_text(document(said), encoding="utf-8")
        tab.wait("document.querySelector('#twin').textContent.includes('loss +18 %')")
        assert tab.tab.evaluate("window.hacked") is None
        assert [said for said in tab.complaints if "readback" not in said] == []  # of this test's own looks
