"""The comparison itself must see a wrong page."""

from __future__ import annotations

import pytest

from tests.docs.console import differs


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        (["damping 0.231 ± 0.002"], ["damping   0.229 ± 0.003"]),
        (["4 run files in first"], ["4 run files in first"]),
        (["a", "…", "end"], ["a", "b", "c", "end"]),
        (["force … kN, valve off"], ["force -0.1 kN, valve off"]),
        (["2026-11-22 08:18:32 static"], ["2031-01-02 03:04:05 static"]),
        (["", "a"], ["a", ""]),
        (["…"], []),
    ],
)
def test_what_a_page_may_leave_open(shown, printed):
    assert differs(shown, printed) is None


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        (["damping 0.231"], ["damping 0.331"]),
        (["4 run files"], ["3 run files"]),
        (["a", "end"], ["a", "b", "end"]),
        (["a", "…", "end"], ["a", "b"]),
        (["a"], ["a", "b"]),
        (["a"], []),
        (["stored absorbed"], ["stored damping"]),
    ],
)
def test_what_a_page_may_not_say(shown, printed):
    assert differs(shown, printed) is not None
