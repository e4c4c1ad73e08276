"""Tables on terminals of any width."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.cli import terminal_tables

COLUMNS = [
    ("file", "whole"),
    ("step", "left"),
    ("prestress ±\namplitude mm", "right"),
    ("peak force kN", "right"),
    ("started (UTC)", "left"),
    ("verdict\n", "whole"),
]
ROWS = [
    ["003-harmonic-20mm-20mm.h5", "constant amplitude: 20 ± 20 mm, 40 mm/s", "20.0 ± 20.0", "111.25",
     "2026-11-21 03:00:23", "inconclusive"],
    ["013-harmonic-78mm-15mm.h5", "warming up", "78.0 ± 15.0", "543.75", "2026-11-21 03:02:43", "—"],
]  # fmt: skip


def _shown(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], width: int) -> str:
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setenv("FORCE_COLOR", "1")
    terminal_tables.show_table(COLUMNS, ROWS, title="a title")
    return re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out)


@pytest.mark.parametrize("width", [60, 72, 80, 100, 132])
def test_no_line_is_longer_than_the_terminal_and_no_number_is_broken(
    width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = _shown(monkeypatch, capsys, width)
    assert max(map(len, shown.splitlines())) <= width
    for row in ROWS:
        for cell in (row[0], *row[2:]):
            assert cell in shown


def test_a_table_that_fits_is_one_and_one_that_does_not_repeats_its_first_column(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _shown(monkeypatch, capsys, 160).count(ROWS[0][0]) == 1
    narrow = _shown(monkeypatch, capsys, 72)
    parts = narrow.split("\n\n")
    assert len(parts) > 1
    assert all(ROWS[0][0] in part and ROWS[1][0] in part for part in parts)


def test_headings_are_broken_between_words_and_end_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = _shown(monkeypatch, capsys, 72)
    for word in ("prestress", "amplitude", "peak", "force", "started", "verdict"):
        assert word in shown
    for part in shown.removeprefix("a title").split("\n\n"):
        above = part[: part.index(ROWS[0][0])].rstrip("\n").splitlines()
        assert above[-1].startswith("file")


def test_where_nobody_looks_a_table_is_one_of_long_lines(capsys: pytest.CaptureFixture[str]) -> None:
    terminal_tables.show_table(COLUMNS, ROWS)
    assert len(capsys.readouterr().out.splitlines()) == 1 + 1 + len(ROWS)


WORDS = st.text("abc 0123456789.", min_size=0, max_size=40)


@given(
    st.lists(st.tuples(WORDS, st.sampled_from(["left", "right", "whole"]), WORDS), min_size=1, max_size=12),
    st.integers(20, 200),
)
def test_a_part_holds_the_first_column_and_each_other_once(
    columns: list[tuple[str, str, str]], width: int
) -> None:
    table = [terminal_tables._Column(heading, side, (cell,)) for heading, side, cell in columns]
    parts = list(terminal_tables._parts(table, width))
    assert [part[0].cells for part in parts] == [table[0].cells] * len(parts)
    assert [column.cells for part in parts for column in part[1:]] == [column.cells for column in table[1:]]
