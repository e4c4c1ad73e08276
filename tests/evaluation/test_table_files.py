"""Tables as files: what a program that opens them finds."""

from __future__ import annotations

from pathlib import Path

import openpyxl
import pandas as pd
import pytest

from bufferstand.evaluation.document.tables import EXCEL_CHARACTERS, write_frames
from bufferstand.foundation.errors import BadInput

TEXTS = ["=1+1", "a\x01b", "y" * (EXCEL_CHARACTERS + 5), None, "−Ω\n"]


@pytest.fixture(params=["object", "str"])
def frame(request: pytest.FixtureRequest) -> pd.DataFrame:
    columns = {"specimen": TEXTS, "damping": [0.25, None, 0.5, 1.0, 2.0]}
    return pd.DataFrame(columns).astype({"specimen": request.param})


def test_texts_are_texts_in_a_workbook(tmp_path: Path, frame: pd.DataFrame) -> None:
    path = tmp_path / "runs.xlsx"
    write_frames({"runs": frame}, path)
    sheet = openpyxl.load_workbook(path)["runs"]
    cells = [row[0] for row in sheet.iter_rows(min_row=2)]
    assert "f" not in {cell.data_type for cell in cells}  # no formula
    shown = ["=1+1", "a\ufffdb", "y" * (EXCEL_CHARACTERS - 1) + "…", None, "−Ω\n"]
    assert [cell.value for cell in cells] == shown
    assert [row[1].value for row in sheet.iter_rows(min_row=2)] == [0.25, None, 0.5, 1.0, 2.0]
    assert frame["specimen"].to_list()[:3] == TEXTS[:3]  # the table itself stays as it was


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".xlsx"])
def test_a_table_that_was_there_stays_when_the_disk_is_full(
    tmp_path: Path, frame: pd.DataFrame, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"runs{suffix}"
    path.write_bytes(b"before")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    monkeypatch.setattr(pd.DataFrame, "to_csv", full)
    monkeypatch.setattr(pd.DataFrame, "to_parquet", full)
    with pytest.raises(BadInput, match="cannot be written: No space left on device"):
        write_frames({"runs": frame}, path)
    assert path.read_bytes() == b"before"
    assert [item.name for item in tmp_path.iterdir()] == [path.name]
