"""Names that are formulas to a spreadsheet, or orders to a terminal, do nothing where they are shown."""

from __future__ import annotations

import csv
import os
import pty
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from bufferstand.evaluation.document import write_frames
from bufferstand.evaluation.document.tables import cycle_csv
from bufferstand.foundation import as_cell, plain, plain_but_for_displays
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings import load_settings
from bufferstand.foundation.specimen import SpecimenFile

ROOT = Path(__file__).resolve().parents[2]
LINK = '=HYPERLINK("http://a.example","b")'
ORDERS = "\x1b]0;mine\x07\x1b[2J\x9b31m\u202egnp"


@pytest.mark.parametrize("text", [LINK, "+1+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1", "a\n=1", "a,=1"])
def test_a_formula_begins_with_an_apostrophe(text: str) -> None:
    assert any(f"'{sign}" in as_cell(text) for sign in "=+-@")


@pytest.mark.parametrize("text", ["-12", "+1.5e-3", "A-105-E-01", "a = b", "", "2026-01-01"])
def test_numbers_and_names_stay(text: str) -> None:
    assert as_cell(text) == text


def test_no_cell_of_a_table_is_a_formula(tmp_path: Path) -> None:
    write_frames({"runs": pd.DataFrame({"specimen": [LINK], "value": [-1.5]})}, tmp_path / "a.csv")
    row = list(csv.reader((tmp_path / "a.csv").read_text("utf-8").splitlines()))[1]
    assert row == [f"'{LINK}", "-1.5"]
    columns = ("run", "path", "kind", "specimen", "sha256", "settings_sha256", "version")
    names = {column: [LINK] for column in columns}
    lines = list(csv.reader("".join(cycle_csv(names, ["1,2"])).splitlines()))
    assert [cell[:2] for cell in lines[1] if "HYPERLINK" in cell] == ["'="] * 7


def test_orders_to_a_terminal_are_written_out() -> None:
    assert plain(ORDERS) == r"\x1b]0;mine\x07\x1b[2J\x9b31m\u202egnp"
    assert plain("Prüf\n\t™") == "Prüf\n\t™"
    ours = "\r\x1b[K\x1b[1mbold\x1b[0m\n"
    assert plain_but_for_displays(ours) == ours
    assert "\x1b]" not in plain_but_for_displays(ORDERS)


def test_a_message_is_plain() -> None:
    assert "\x1b" not in str(BadInput(ORDERS, file=f"a{ORDERS}"))


def test_a_settings_file_with_orders_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "specimen.toml"
    path.write_text('[specimen]\nid = "a\\u001b]0;b"\nmax_stroke_mm = 105.0\n', "utf-8")
    with pytest.raises(BadInput, match=r"line 2: specimen\.id: a text with control characters"):
        load_settings(path, SpecimenFile)


def test_a_terminal_is_shown_names_and_obeys_none(tmp_path: Path) -> None:
    """A file whose name holds orders, verified on a real terminal."""
    path = tmp_path / "a\x1b]0;mine\x07.h5"
    path.write_bytes(b"no run file")
    ours, theirs = pty.openpty()
    ended = subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand", "verify", str(path)],
        stdin=theirs, stdout=theirs, stderr=theirs, cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    os.close(theirs)
    shown = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:  # everything that was shown has been read, and the terminal is gone
            break
        if not part:
            break
        shown += part
    os.close(ours)
    assert ended.wait() == 2
    assert rb"\x1b]0;mine" in shown
    assert b"\x1b]" not in shown
    assert b"\x07" not in shown
